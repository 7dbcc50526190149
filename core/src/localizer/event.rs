//! What the localiser is told.

use serde::{Deserialize, Serialize};

use crate::geometry::Pose;
use crate::measurement::{EncoderSample, PoseIncrement, Reflectors, Scan, SpeedSample, Time};

/// A pose that is given from outside: by an operator, by a start position, or by relocalisation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseFix {
    /// When the vehicle was there.
    pub time: Time,
    /// Pose of R in W.
    pub pose: Pose,
    /// Standard deviation of the position along each axis, m.
    pub position_deviation: f64,
    /// Standard deviation of the heading, rad.
    pub heading_deviation: f64,
}

/// One thing that a sensor or an operator said, with the time at which it was true.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event<'a> {
    /// Counters of a tricycle's encoders.
    Encoders(EncoderSample),
    /// Speed and steering angle.
    Speed(SpeedSample),
    /// Motion that the vehicle has integrated itself.
    Increment(PoseIncrement),
    /// Reflectors that the sensor has found.
    Reflectors(Reflectors<'a>),
    /// Ranges of one sweep of the laser.
    Scan(Scan<'a>),
    /// A pose from outside.
    SetPose(PoseFix),
}
