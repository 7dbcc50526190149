//! The vehicle: what kind it is, chosen from a list, and its measures.

use agv_core::odometry::{
    Ackermann, AckermannWheels, AngleEncoder, BiSteerable, CounterRange, Differential, DrivenWheel, Mecanum,
    Omnidirectional, SteeredWheel, Tricycle, TricycleSpeed, Vehicle, WheelVehicle,
};

/// How a vehicle moves and what it reports. The number of a kind never gets another meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum VehicleKind {
    /// A front wheel that steers and drives, with two counters.
    Tricycle = 0,
    /// The same, whose own controller tells speed and steering angle.
    TricycleSpeed = 1,
    /// A car whose own controller tells the speed of a rear wheel and the steering angle.
    CarSpeed = 2,
    /// Two driven wheels side by side.
    Differential = 3,
    /// Two wheels that steer and drive.
    BiSteerable = 4,
    /// A car with counters at its rear wheels and its steering.
    Ackermann = 5,
    /// Three omnidirectional wheels.
    Omni3 = 6,
    /// Four omnidirectional wheels.
    Omni4 = 7,
    /// Four mecanum wheels.
    Mecanum = 8,
    /// A vehicle whose own controller tells how far it has moved.
    Increments = 9,
}

impl VehicleKind {
    /// All kinds, at their numbers.
    pub const ALL: [Self; 10] = [
        Self::Tricycle,
        Self::TricycleSpeed,
        Self::CarSpeed,
        Self::Differential,
        Self::BiSteerable,
        Self::Ackermann,
        Self::Omni3,
        Self::Omni4,
        Self::Mecanum,
        Self::Increments,
    ];

    /// Their names, at their numbers.
    pub const NAMES: [&'static str; 10] = [
        "tricycle",
        "tricycle_speed",
        "car_speed",
        "differential",
        "bi_steerable",
        "ackermann",
        "omni3",
        "omni4",
        "mecanum",
        "increments",
    ];

    /// The kind with that number.
    #[must_use]
    pub const fn of_number(number: u8) -> Option<Self> {
        let mut left: &[Self] = &Self::ALL;
        while let Some((kind, others)) = left.split_first() {
            if *kind as u8 == number {
                return Some(*kind);
            }
            left = others;
        }
        None
    }

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::NAMES.get(usize::from(self as u8)).copied().unwrap_or_default()
    }
}

/// One wheel of a vehicle with several, in the order of its kinematics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelSettings {
    /// Way for one tick, m; negative if it counts the other way.
    pub scale: f64,
    /// Range of the counter of its turn.
    pub range: CounterRange,
    /// Place of its steering axis, m ahead of R.
    pub x: f64,
    /// Place of its steering axis, m to the left of R.
    pub y: f64,
    /// Steering angle for one tick, rad.
    pub steering_scale: f64,
    /// Range of the counter of its steering angle.
    pub steering_range: CounterRange,
    /// What is added to its steering angle, rad.
    pub steering_offset: f64,
}

impl WheelSettings {
    /// Whose radius is 1 m: the way of a tick is what counts.
    const fn driven(&self) -> DrivenWheel {
        DrivenWheel { radius: 1.0, turn: AngleEncoder { scale: self.scale, range: self.range } }
    }

    const fn steered(&self) -> SteeredWheel {
        SteeredWheel {
            x: self.x,
            y: self.y,
            drive: self.driven(),
            steering: AngleEncoder { scale: self.steering_scale, range: self.steering_range },
            steering_offset: self.steering_offset,
        }
    }

    const fn take_driven(&mut self, wheel: &DrivenWheel) {
        (self.scale, self.range) = (wheel.radius * wheel.turn.scale, wheel.turn.range);
    }

    const fn take_steered(&mut self, wheel: &SteeredWheel) {
        self.take_driven(&wheel.drive);
        (self.x, self.y, self.steering_offset) = (wheel.x, wheel.y, wheel.steering_offset);
        (self.steering_scale, self.steering_range) = (wheel.steering.scale, wheel.steering.range);
    }
}

/// The measures of all kinds; those of another kind mean nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VehicleSettings {
    /// What kind it is.
    pub kind: VehicleKind,
    /// From the rear axle to the front axle, or to the axis of the steered wheel, m.
    pub wheelbase: f64,
    /// Distance between the contacts of the wheels of an axle, m.
    pub track: f64,
    /// From the middle to the contacts of omnidirectional wheels, m.
    pub arm: f64,
    /// Direction from the middle to the first omnidirectional wheel, rad.
    pub first_wheel: f64,
    /// Of a car that tells its speed: how far to the left the wheel is that does so, m.
    pub speed_wheel: f64,
    /// Way of a tricycle's driving wheel for one tick, m.
    pub drive_scale: f64,
    /// Range of its counter.
    pub drive_range: CounterRange,
    /// Steering angle of a tricycle or a car for one tick, rad.
    pub steering_scale: f64,
    /// Range of its counter.
    pub steering_range: CounterRange,
    /// What is added to the steering angle driving forward, rad.
    pub steering_offset_forward: f64,
    /// The same driving backward.
    pub steering_offset_backward: f64,
    /// The wheels of a vehicle with several.
    pub wheels: [WheelSettings; 4],
}

impl Default for VehicleSettings {
    /// The tricycle of the standard simulated world; other kinds are about as large.
    fn default() -> Self {
        let (steering_scale, steering_range) = (core::f64::consts::TAU / 65_536.0, CounterRange::BITS_16);
        let wheel = |x| WheelSettings {
            scale: 1e-4,
            range: CounterRange::BITS_32,
            x,
            y: 0.0,
            steering_scale,
            steering_range,
            steering_offset: 0.0,
        };
        Self {
            kind: VehicleKind::Tricycle,
            wheelbase: 1.5,
            track: 0.8,
            arm: 0.4,
            first_wheel: core::f64::consts::FRAC_PI_4,
            speed_wheel: 0.0,
            drive_scale: 1e-4,
            drive_range: CounterRange::BITS_32,
            steering_scale,
            steering_range,
            steering_offset_forward: 0.0,
            steering_offset_backward: 0.0,
            wheels: [wheel(0.75), wheel(-0.75), wheel(0.0), wheel(0.0)],
        }
    }
}

impl VehicleSettings {
    /// As the localiser has it.
    #[must_use]
    pub const fn vehicle(&self) -> Vehicle {
        let [first, second, third, fourth] = &self.wheels;
        match self.kind {
            VehicleKind::Tricycle => Vehicle::Tricycle(Tricycle {
                wheelbase: self.wheelbase,
                drive_scale: self.drive_scale,
                drive_range: self.drive_range,
                steering_scale: self.steering_scale,
                steering_range: self.steering_range,
                steering_offset_forward: self.steering_offset_forward,
                steering_offset_backward: self.steering_offset_backward,
            }),
            VehicleKind::TricycleSpeed => Vehicle::TricycleSpeed(TricycleSpeed {
                wheelbase: self.wheelbase,
                steering_offset: self.steering_offset_forward,
            }),
            VehicleKind::CarSpeed => {
                Vehicle::Ackermann(Ackermann { wheelbase: self.wheelbase, encoder_offset: self.speed_wheel })
            }
            VehicleKind::Increments => Vehicle::Increments,
            VehicleKind::Differential => Vehicle::Wheels(WheelVehicle::Differential(self.axle())),
            VehicleKind::BiSteerable => Vehicle::Wheels(WheelVehicle::BiSteerable(BiSteerable {
                front: first.steered(),
                rear: second.steered(),
            })),
            VehicleKind::Ackermann => Vehicle::Wheels(WheelVehicle::Ackermann(AckermannWheels {
                rear: self.axle(),
                wheelbase: self.wheelbase,
                steering: AngleEncoder { scale: self.steering_scale, range: self.steering_range },
                steering_offset: self.steering_offset_forward,
            })),
            VehicleKind::Omni3 => Vehicle::Wheels(WheelVehicle::ThreeOmnidirectional(Omnidirectional {
                arm: self.arm,
                first: self.first_wheel,
                driven: [first.driven(), second.driven(), third.driven()],
            })),
            VehicleKind::Omni4 => Vehicle::Wheels(WheelVehicle::FourOmnidirectional(Omnidirectional {
                arm: self.arm,
                first: self.first_wheel,
                driven: [first.driven(), second.driven(), third.driven(), fourth.driven()],
            })),
            VehicleKind::Mecanum => Vehicle::Wheels(WheelVehicle::Mecanum(Mecanum {
                wheelbase: self.wheelbase,
                track: self.track,
                driven: [first.driven(), second.driven(), third.driven(), fourth.driven()],
            })),
        }
    }

    /// Left and right wheel.
    const fn axle(&self) -> Differential {
        let [left, right, ..] = &self.wheels;
        Differential { track: self.track, left: left.driven(), right: right.driven() }
    }

    /// The measures of a vehicle; what it does not have is as by default.
    #[must_use]
    pub fn of(vehicle: &Vehicle) -> Self {
        let mut settings = Self::default();
        settings.take(vehicle);
        settings
    }

    fn take(&mut self, vehicle: &Vehicle) {
        match vehicle {
            Vehicle::Tricycle(tricycle) => {
                self.kind = VehicleKind::Tricycle;
                self.wheelbase = tricycle.wheelbase;
                (self.drive_scale, self.drive_range) = (tricycle.drive_scale, tricycle.drive_range);
                (self.steering_scale, self.steering_range) = (tricycle.steering_scale, tricycle.steering_range);
                self.steering_offset_forward = tricycle.steering_offset_forward;
                self.steering_offset_backward = tricycle.steering_offset_backward;
            }
            Vehicle::TricycleSpeed(tricycle) => {
                self.kind = VehicleKind::TricycleSpeed;
                (self.wheelbase, self.steering_offset_forward) = (tricycle.wheelbase, tricycle.steering_offset);
            }
            Vehicle::Ackermann(car) => {
                self.kind = VehicleKind::CarSpeed;
                (self.wheelbase, self.speed_wheel) = (car.wheelbase, car.encoder_offset);
            }
            Vehicle::Increments => self.kind = VehicleKind::Increments,
            Vehicle::Wheels(vehicle) => self.take_wheels(vehicle),
        }
    }

    fn take_wheels(&mut self, vehicle: &WheelVehicle) {
        match vehicle {
            WheelVehicle::Differential(vehicle) => {
                self.kind = VehicleKind::Differential;
                self.take_axle(vehicle);
            }
            WheelVehicle::BiSteerable(vehicle) => {
                self.kind = VehicleKind::BiSteerable;
                let [front, rear, ..] = &mut self.wheels;
                front.take_steered(&vehicle.front);
                rear.take_steered(&vehicle.rear);
            }
            WheelVehicle::Ackermann(car) => {
                self.kind = VehicleKind::Ackermann;
                self.take_axle(&car.rear);
                (self.wheelbase, self.steering_offset_forward) = (car.wheelbase, car.steering_offset);
                (self.steering_scale, self.steering_range) = (car.steering.scale, car.steering.range);
            }
            WheelVehicle::ThreeOmnidirectional(vehicle) => {
                self.kind = VehicleKind::Omni3;
                (self.arm, self.first_wheel) = (vehicle.arm, vehicle.first);
                self.take_driven(&vehicle.driven);
            }
            WheelVehicle::FourOmnidirectional(vehicle) => {
                self.kind = VehicleKind::Omni4;
                (self.arm, self.first_wheel) = (vehicle.arm, vehicle.first);
                self.take_driven(&vehicle.driven);
            }
            WheelVehicle::Mecanum(vehicle) => {
                self.kind = VehicleKind::Mecanum;
                (self.wheelbase, self.track) = (vehicle.wheelbase, vehicle.track);
                self.take_driven(&vehicle.driven);
            }
        }
    }

    fn take_axle(&mut self, axle: &Differential) {
        self.track = axle.track;
        self.take_driven(&[axle.left, axle.right]);
    }

    fn take_driven(&mut self, driven: &[DrivenWheel]) {
        self.wheels.iter_mut().zip(driven).for_each(|(wheel, driven)| wheel.take_driven(driven));
    }
}
