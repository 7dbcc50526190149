//! Every kind of vehicle that the parameters can describe, and how its wheels follow a motion.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use agv_core::geometry::Twist;
use agv_core::odometry::{
    Ackermann, AckermannWheels, AngleEncoder, BiSteerable, Contact, CounterRange, Differential, DrivenWheel, Mecanum,
    Omnidirectional, SteeredWheel, Tricycle, TricycleSpeed, Vehicle, Wheel, WheelBased, WheelVehicle,
};

pub const WHEELBASE: f64 = 1.2;
const TRACK: f64 = 0.6;
const RADIUS: f64 = 0.1;
/// Of a steering encoder, rad.
pub const STEERING_TICK: f64 = 1e-4;
/// Of the wheel whose speed a car reports, m to the left.
const SPEED_WHEEL: f64 = 0.3;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Tricycle,
    TricycleSpeed,
    CarSpeed,
    Increments,
    Differential,
    Car,
    BiSteerable,
    Omni3,
    Omni4,
    Mecanum,
}

impl Kind {
    pub const ALL: [Self; 10] = [
        Self::Tricycle,
        Self::TricycleSpeed,
        Self::CarSpeed,
        Self::Increments,
        Self::Differential,
        Self::Car,
        Self::BiSteerable,
        Self::Omni3,
        Self::Omni4,
        Self::Mecanum,
    ];

    /// With drive encoders of that tick, m.
    pub fn vehicle(self, tick: f64) -> Vehicle {
        let range = CounterRange::BITS_32;
        let driven = DrivenWheel { radius: RADIUS, turn: AngleEncoder { scale: tick / RADIUS, range } };
        let steering = AngleEncoder { scale: STEERING_TICK, range };
        let steered = |x: f64| SteeredWheel { x, y: 0.0, drive: driven, steering, steering_offset: 0.0 };
        let differential = Differential { track: TRACK, left: driven, right: driven };
        let around = |first: f64| (0.5, first);
        match self {
            Self::Tricycle => Vehicle::Tricycle(Tricycle {
                wheelbase: WHEELBASE,
                drive_scale: tick,
                drive_range: range,
                steering_scale: STEERING_TICK,
                steering_range: range,
                steering_offset_forward: 0.0,
                steering_offset_backward: 0.0,
            }),
            Self::TricycleSpeed => Vehicle::TricycleSpeed(TricycleSpeed { wheelbase: WHEELBASE, steering_offset: 0.0 }),
            Self::CarSpeed => Vehicle::Ackermann(Ackermann { wheelbase: WHEELBASE, encoder_offset: SPEED_WHEEL }),
            Self::Increments => Vehicle::Increments,
            Self::Differential => Vehicle::Wheels(WheelVehicle::Differential(differential)),
            Self::Car => Vehicle::Wheels(WheelVehicle::Ackermann(AckermannWheels {
                rear: differential,
                wheelbase: WHEELBASE,
                steering,
                steering_offset: 0.0,
            })),
            Self::BiSteerable => {
                Vehicle::Wheels(WheelVehicle::BiSteerable(BiSteerable { front: steered(0.7), rear: steered(-0.7) }))
            }
            Self::Omni3 => {
                let (arm, first) = around(0.0);
                Vehicle::Wheels(WheelVehicle::ThreeOmnidirectional(Omnidirectional { arm, first, driven: [driven; 3] }))
            }
            Self::Omni4 => {
                let (arm, first) = around(FRAC_PI_4);
                Vehicle::Wheels(WheelVehicle::FourOmnidirectional(Omnidirectional { arm, first, driven: [driven; 4] }))
            }
            Self::Mecanum => {
                Vehicle::Wheels(WheelVehicle::Mecanum(Mecanum { wheelbase: 1.0, track: 0.8, driven: [driven; 4] }))
            }
        }
    }

    pub fn moves_sideways(self) -> bool {
        matches!(self, Self::BiSteerable | Self::Omni3 | Self::Omni4 | Self::Mecanum | Self::Increments)
    }

    pub fn turns_on_the_spot(self) -> bool {
        !matches!(self, Self::Car | Self::CarSpeed)
    }
}

/// What turns and steers: the wheels of the general model, or the one wheel of a vehicle that reports one.
pub struct Running {
    kind: Kind,
    wheels: Vec<Wheel>,
    /// Steering angles as they stand, rad.
    pub steering: [f64; 4],
}

impl Running {
    pub fn new(kind: Kind) -> Self {
        let wheels = match kind.vehicle(1e-4) {
            Vehicle::Wheels(vehicle) => vehicle.wheels().as_ref().to_vec(),
            _ => Vec::new(),
        };
        Self { kind, wheels, steering: [0.0; 4] }
    }

    /// How far the rims of the measured wheels roll on an arc of R, m, forward positive; steered wheels stand along it.
    pub fn roll(&mut self, arc: &Twist) -> [f64; 4] {
        let mut rolled = [0.0; 4];
        match self.kind {
            Kind::Tricycle | Kind::TricycleSpeed => {
                rolled[0] = self.steer(0, arc.x, WHEELBASE * arc.theta);
            }
            Kind::CarSpeed => {
                self.steer(0, arc.x, WHEELBASE * arc.theta);
                rolled[0] = arc.x - SPEED_WHEEL * arc.theta;
            }
            Kind::Increments => {}
            _ => {
                for (number, wheel) in self.wheels.clone().iter().enumerate() {
                    let contact = (arc.x - arc.theta * wheel.y, arc.y + arc.theta * wheel.x);
                    if wheel.steering.is_some() {
                        rolled[number] = self.steer(number, contact.0, contact.1);
                        continue;
                    }
                    let roller = match wheel.contact {
                        Contact::Tyre => 0.0,
                        Contact::Rollers(angle) => angle,
                    };
                    let (sine, cosine) = (wheel.heading + roller).sin_cos();
                    rolled[number] = (contact.0 * cosine + contact.1 * sine) / roller.cos();
                }
            }
        }
        rolled
    }

    /// Stands a wheel along the motion of its contact, within a quarter of a turn, and tells how far it rolls.
    fn steer(&mut self, number: usize, along: f64, across: f64) -> f64 {
        let way = along.hypot(across);
        if way < 1e-12 {
            return 0.0;
        }
        let angle = across.atan2(along);
        // It rolls backward rather than to turn by more than a quarter.
        let (angle, sign) = match angle {
            angle if angle > FRAC_PI_2 + 1e-9 => (angle - PI, -1.0),
            angle if angle < -FRAC_PI_2 - 1e-9 => (angle + PI, -1.0),
            angle => (angle, 1.0),
        };
        self.steering[number] = angle;
        sign * way
    }
}
