//! How the way is driven, and what the vehicle is like, in truth and in belief.

use serde::{Deserialize, Serialize};

use super::PoseOptions;

/// How the way is driven.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DriveOptions {
    /// Speed of the logical point, m/s.
    pub speed: f64,
    /// Acceleration, m/s2.
    pub acceleration: f64,
    /// Braking, m/s2.
    pub braking: f64,
    /// Standstill at the start, s.
    pub start_standstill: f64,
    /// Standstill at the end, s.
    pub end_standstill: f64,
    /// Standstill between two legs, s, in which the wheel turns to its new angle.
    pub stop_between_legs: f64,
    /// Fastest turn of the driving wheel, degrees a second.
    pub steering_rate_deg: f64,
    /// When the vehicle is lifted and set down elsewhere.
    pub carries: Vec<Carry>,
}

/// The vehicle is lifted and set down elsewhere; its wheel does not turn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Carry {
    /// When, s after the drive's first event.
    pub from: f64,
    /// Forward, in R, m.
    #[serde(default)]
    pub x: f64,
    /// To the left, in R, m.
    #[serde(default)]
    pub y: f64,
    /// Counter-clockwise.
    #[serde(default)]
    pub heading_deg: f64,
}

impl Default for DriveOptions {
    fn default() -> Self {
        Self {
            speed: 0.8,
            acceleration: 0.3,
            braking: 0.3,
            start_standstill: 1.0,
            end_standstill: 0.5,
            stop_between_legs: 1.0,
            steering_rate_deg: 60.0,
            carries: Vec::new(),
        }
    }
}

/// The vehicle.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct VehicleOptions {
    /// What it reports of its motion.
    pub reports: MotionReport,
    /// What the localiser believes.
    pub believed: BelievedVehicle,
    /// In what the truth differs.
    #[serde(rename = "true")]
    pub truth: VehicleErrors,
}

/// What the vehicle reports of its motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MotionReport {
    /// Counters of a tricycle's wheel.
    #[default]
    Encoders,
    /// Speed and steering angle of a car.
    Speed,
    /// Displacements.
    Increments,
    /// Counters of two driven wheels side by side.
    Differential,
    /// Counters of two wheels that steer and drive, one behind the other.
    BiSteerable,
    /// Counters of four omnidirectional wheels.
    Omnidirectional,
    /// Speed and steering angle of a tricycle's wheel.
    TricycleSpeed,
    /// Counters of the rear wheels and of the steering of a car.
    Ackermann,
    /// Counters of three omnidirectional wheels.
    ThreeOmnidirectional,
    /// Counters of four mecanum wheels.
    Mecanum,
}

/// What the localiser believes of the vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BelievedVehicle {
    /// Distance from the rear axle to the steering axis, m.
    pub wheelbase: f64,
    /// Way of the driving wheel for one tick, m. The standard one is that of K table 5.1.
    pub drive_scale: f64,
    /// Values of the driving wheel's counter. The standard one has 16 bits, as the incremental encoders of drives have.
    pub drive_counter: u64,
    /// Values of the steering counter, which makes one turn with the wheel. The standard one is an absolute encoder of
    /// 16 bits a turn, 0.0055 degrees a tick.
    pub steering_counter: u64,
    /// Steering offset while driving forward.
    pub steering_offset_forward_deg: f64,
    /// Steering offset while driving backward.
    pub steering_offset_backward_deg: f64,
    /// Distance of the wheel with the speed sensor to the left of the axis, m; for a car.
    pub encoder_offset: f64,
    /// Distance of the wheels of an axle, and of opposite omnidirectional ones, m.
    pub track: f64,
}

impl Default for BelievedVehicle {
    fn default() -> Self {
        Self {
            wheelbase: 1.5,
            drive_scale: 0.249_75e-3,
            drive_counter: 1 << 16,
            steering_counter: 1 << 16,
            steering_offset_forward_deg: 0.0,
            steering_offset_backward_deg: 0.0,
            encoder_offset: 0.0,
            track: 0.8,
        }
    }
}

/// In what the true vehicle differs from the believed one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct VehicleErrors {
    /// True way for a tick over the believed one, minus one.
    pub drive_scale_error: f64,
    /// True steering offset minus the believed one, in both senses of travel.
    pub steering_offset_error_deg: f64,
    /// What is added to that backward.
    pub steering_offset_backward_error_deg: f64,
    /// Radius of a left wheel over that of a right one, of front over rear, minus one, of a vehicle with several; the seed chooses the
    /// sign with that of the steering offset.
    pub wheel_difference: f64,
    /// Whether the seed chooses the signs of the two errors above.
    pub random_signs: bool,
    /// True wheelbase minus the believed one, m.
    pub wheelbase_error: f64,
    /// A mistake: the driving wheel's encoder counts the wrong way.
    pub drive_reversed: bool,
    /// A mistake: the steering's encoder counts the wrong way.
    pub steering_reversed: bool,
    /// A mistake: each encoder is taken for the other.
    pub encoders_swapped: bool,
    /// True mounting of the laser (S in R) minus the believed one, component by component.
    pub laser_error: PoseOptions,
}

impl Default for VehicleErrors {
    fn default() -> Self {
        Self {
            drive_scale_error: 0.002,
            steering_offset_error_deg: 0.05,
            steering_offset_backward_error_deg: 0.0,
            wheel_difference: 5e-4,
            random_signs: true,
            wheelbase_error: 0.0,
            drive_reversed: false,
            steering_reversed: false,
            encoders_swapped: false,
            laser_error: PoseOptions::default(),
        }
    }
}

/// Disturbances of the motion and noise of the encoders.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OdometryOptions {
    /// Samples a second.
    pub rate: f64,
    /// Standard deviation of what the driving wheel turns too much or too little, m for the root of a metre.
    pub slip: f64,
    /// Standard deviation of a reading of the steering angle.
    pub steering_noise_deg: f64,
    /// Standard deviation of an error of the steering angle that lasts for a leg of the way.
    pub leg_steering_error_deg: f64,
    /// Standard deviation of slip that lasts for a leg of the way, as a share of the way.
    pub leg_slip: f64,
    /// Standard deviation of the heading's walk, degrees for the root of a metre.
    pub yaw_walk_deg: f64,
    /// Standard deviation of the shift to the side, m for the root of a metre.
    pub side_slip: f64,
    /// When a wheel slips.
    pub slips: Vec<Slip>,
}

/// A wheel slips for some time: it turns more than it goes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Slip {
    /// When it begins, s after the drive's first event.
    pub from: f64,
    /// How long it lasts, s.
    pub lasts: f64,
    /// What it turns too much, as a share of its way.
    pub share: f64,
    /// Which wheel, from 0.
    #[serde(default)]
    pub wheel: u8,
}

impl OdometryOptions {
    /// What the wheel of that number turns too much at a time after the first event, as a share of its way.
    #[must_use]
    pub fn slip_of(&self, wheel: u8, time: f64) -> f64 {
        let is_now = |slip: &&Slip| slip.wheel == wheel && (slip.from..slip.from + slip.lasts).contains(&time);
        self.slips.iter().filter(is_now).map(|slip| slip.share).sum()
    }
}

impl Default for OdometryOptions {
    fn default() -> Self {
        Self {
            rate: 100.0,
            slip: 3e-3,
            steering_noise_deg: 0.01,
            leg_steering_error_deg: 0.0,
            leg_slip: 0.0,
            yaw_walk_deg: 0.02,
            side_slip: 0.5e-3,
            slips: Vec::new(),
        }
    }
}

impl OdometryOptions {
    /// Perfect wheels on a perfect floor.
    #[must_use]
    pub fn perfect() -> Self {
        Self { slip: 0.0, steering_noise_deg: 0.0, yaw_walk_deg: 0.0, side_slip: 0.0, ..Self::default() }
    }
}
