//! Measurements of the vehicle's own motion.

use serde::{Deserialize, Serialize};

use super::Time;
use crate::geometry::Pose;

/// Raw counters of a tricycle's two encoders, read at one time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct EncoderSample {
    /// When the counters were read.
    pub time: Time,
    /// Counter of the driving wheel, ticks, wrapping at the encoder's own range.
    pub drive: u32,
    /// Counter of the steering angle, ticks, wrapping at the encoder's own range.
    pub steering: u32,
}

/// Speed and steering angle of a vehicle that reports them in physical units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SpeedSample {
    /// When both values were true.
    pub time: Time,
    /// Speed of the wheel that carries the encoder, m/s, positive forward.
    pub speed: f64,
    /// Steering angle, rad, positive to the left.
    pub steering: f64,
}

/// Motion since the previous increment, from a vehicle that integrates its own odometry.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseIncrement {
    /// End of the interval; its start is the end of the previous one.
    pub time: Time,
    /// Displacement of R in the frame of R at the start of the interval.
    pub displacement: Pose,
}
