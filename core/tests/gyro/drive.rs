//! A drive with a gyro whose truth is known.

use std::f64::consts::PI;

use agv_core::geometry::{Point, Pose, Twist, difference};
use agv_core::localizer::{Event, Localizer, Parameters, PoseFix};
use agv_core::maps::Landmark;
use agv_core::measurement::{GyroSample, ReflectorObservation, Reflectors, Time, WheelReading, WheelSample};
use agv_core::odometry::{
    AngleEncoder, CounterRange, Differential, DrivenWheel, GyroParameters, Vehicle, WheelVehicle,
};

use super::random::{FITTED, Random};

pub const TICK: f64 = 1e-4;

pub const RADIUS: f64 = 0.1;

pub const TRACK: f64 = 0.6;

pub fn vehicle() -> Vehicle {
    let turn = AngleEncoder { scale: TICK / RADIUS, range: CounterRange::BITS_16 };
    let wheel = DrivenWheel { radius: RADIUS, turn };
    Vehicle::Wheels(WheelVehicle::Differential(Differential { track: TRACK, left: wheel, right: wheel }))
}

pub fn parameters(gyro: GyroParameters) -> Parameters {
    let mut parameters = Parameters::new(vehicle(), Pose::new(0.5, 0.0, 0.0));
    parameters.gyro = gyro;
    parameters
}

/// What goes wrong.
#[derive(Clone, Copy, Default)]
pub struct Wrong {
    /// Share of the way of the left wheel that it turns too much.
    pub slip: f64,
    /// rad/s beside the bias.
    pub jump: f64,
    pub is_frozen: bool,
    pub is_silent: bool,
    pub is_clipped: bool,
}

/// A vehicle with two wheels, a gyro and a laser.
pub struct Drive {
    pub random: Random,
    pub localizer: Box<Localizer>,
    pub time: f64,
    pub truth: Pose,
    pub ways: [f64; 2],
    pub bias: f64,
    pub scale: f64,
    pub told: f64,
    pub wrong: Wrong,
    /// By how much the right wheel is larger than believed.
    pub larger: f64,
    /// How fast it turns, rad/s.
    pub turn: f64,
    pub sees: bool,
    pub reflectors: Vec<Point>,
    pub has_gyro: bool,
}

impl Drive {
    pub fn new(seed: u64, gyro: GyroParameters) -> Self {
        let reflectors: Vec<Point> = (0..12)
            .map(|number| {
                let angle = f64::from(number) * PI / 6.0 + 0.1 * f64::from(number % 5);
                Point::new(14.0 * angle.cos() + f64::from(number % 3), 14.0 * angle.sin())
            })
            .collect();
        let mut localizer: Box<Localizer> = Box::new(Localizer::new(parameters(gyro)));
        let landmarks: Vec<Landmark> =
            reflectors.iter().zip(0..).map(|(place, id)| Landmark::reflector(id, *place, 0.002)).collect();
        localizer.add_landmarks(&landmarks).unwrap();
        let truth = Pose::new(-3.0, 0.5, 0.1);
        let mut drive = Self {
            random: Random(seed),
            localizer,
            time: 1.0,
            truth,
            ways: [3.0, 5.0],
            bias: 5e-3,
            scale: 1.5e-3,
            told: 0.0,
            wrong: Wrong::default(),
            larger: 1e-3,
            turn: 0.0,
            sees: true,
            reflectors,
            has_gyro: gyro.is_fitted,
        };
        let fix = PoseFix { time: drive.now(), pose: truth, position_deviation: 0.02, heading_deviation: 0.01 };
        drive.localizer.handle(&Event::SetPose(fix));
        drive
    }

    pub fn now(&self) -> Time {
        Time::from_seconds(self.time)
    }

    pub fn said(&self) -> agv_core::state::PoseOutput {
        self.localizer.outputs().pose
    }

    /// Heading error, rad.
    pub fn heading_error(&self) -> f64 {
        difference(self.said().pose.theta, self.truth.theta)
    }

    /// Drives on for so many seconds; `look` is called behind each step, until it says that it has seen enough.
    pub fn go(&mut self, seconds: f64, speed: f64, turn: f64, mut look: impl FnMut(&Self) -> bool) -> bool {
        let steps = (seconds / 0.01).round() as usize;
        for _ in 0..steps {
            // It turns faster or slower by 2 rad/s^2.
            self.turn += (turn - self.turn).clamp(-0.02, 0.02);
            let (way, angle) = (0.01 * speed, 0.01 * self.turn);
            // The floor turns the vehicle a little.
            let walk = 3.5e-4 * way.abs().sqrt() * self.random.normal();
            self.truth = self.truth.compose(&Pose::exp(&Twist { x: way, y: 0.0, theta: angle + walk }));
            let slip = 5e-4 * way.abs().sqrt();
            self.ways[0] += (way - 0.5 * TRACK * angle) * (1.0 + self.wrong.slip) + slip * self.random.normal();
            self.ways[1] += (way + 0.5 * TRACK * angle) / (1.0 + self.larger) + slip * self.random.normal();
            self.time += 0.01;
            let rate = (angle + walk) / 0.01 / (1.0 + self.scale) + self.bias + self.wrong.jump;
            if self.has_gyro && !self.wrong.is_silent {
                let rate = rate + 8.7e-4 * self.random.normal();
                let quantised = (rate / 1.6e-4).round() * 1.6e-4;
                self.told = if self.wrong.is_frozen { self.told } else { quantised };
                let rate = if self.wrong.is_clipped { FITTED.range } else { self.told };
                self.localizer.handle(&Event::Gyro(GyroSample { time: self.now(), rate }));
            }
            let count =
                |way: f64| WheelReading { count: ((way / TICK).floor() as i64).rem_euclid(65_536) as u32, steering: 0 };
            let mut wheels = [WheelReading::default(); 4];
            (wheels[0], wheels[1]) = (count(self.ways[0]), count(self.ways[1]));
            self.localizer.handle(&Event::Wheels(WheelSample { time: self.now(), wheels }));
            if self.sees && ((self.time * 100.0).round() as u64).is_multiple_of(12) {
                self.revolve();
            }
            if look(self) {
                return true;
            }
        }
        false
    }

    pub fn revolve(&mut self) {
        let laser = self.truth.compose(&Pose::new(0.5, 0.0, 0.0));
        let (sine, cosine) = laser.theta.sin_cos();
        let time = self.now();
        let places = self.reflectors.clone();
        let mut seen: Vec<ReflectorObservation> = Vec::new();
        for place in places {
            let (x, y) = (place.x - laser.x, place.y - laser.y);
            let range = (x * x + y * y).sqrt() + 5e-3 * self.random.normal();
            let bearing = (cosine * y - sine * x).atan2(cosine * x + sine * y) + 8e-4 * self.random.normal();
            seen.push(ReflectorObservation { time, range: range as f32, bearing: bearing as f32 });
        }
        self.localizer.handle(&Event::Reflectors(Reflectors::of_first(&seen)));
    }

    pub fn stand(&mut self, seconds: f64) {
        self.go(seconds, 0.0, 0.0, |_| false);
    }
}

pub fn fitted(seed: u64) -> Drive {
    Drive::new(seed, FITTED)
}
