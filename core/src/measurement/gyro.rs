//! What a rate gyro says.

use serde::{Deserialize, Serialize};

use super::Time;

/// One reading of a rate gyro whose axis points up.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GyroSample {
    /// When the reading was heard; the gyro's latency is not taken from it.
    pub time: Time,
    /// Rate as the gyro tells it, rad/s, positive counter-clockwise of a gyro that is mounted upright.
    pub rate: f64,
}
