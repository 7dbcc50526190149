//! What the encoders of several wheels say.

use serde::{Deserialize, Serialize};

use super::Time;

/// No vehicle reports more wheels.
pub const MOST_WHEELS: usize = 4;

/// Raw counters of one wheel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct WheelReading {
    /// Counter of the wheel's turn, ticks, wrapping at the encoder's own range; of no meaning where none is measured.
    pub count: u32,
    /// Counter of the wheel's steering angle, ticks, wrapping at the encoder's own range; of no meaning for a fixed wheel.
    pub steering: u32,
}

/// Raw counters of all wheels, read at one time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct WheelSample {
    /// When the counters were read.
    pub time: Time,
    /// In the order in which the vehicle's kinematics names its wheels; those that it does not have are zero.
    pub wheels: [WheelReading; MOST_WHEELS],
}
