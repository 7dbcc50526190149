//! Bearings that are wrong by a rule.

use serde::{Deserialize, Serialize};

/// By what a bearing is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BearingError {
    /// By nothing at the beginning of a revolution, behind the laser, and by so much at its end: a step of the bearing that is rounded.
    AlongRevolution,
    /// By so much in each tenth revolution: a lost packet.
    NowAndThen,
    /// By so much to either side in turn: an interlaced laser.
    InTurn,
}

impl BearingError {
    /// What is added to a bearing, in the unit of the size; `number` is that of the revolution.
    pub(super) fn error(self, size: f64, bearing: f64, number: u64) -> f64 {
        match self {
            Self::AlongRevolution => size * (bearing / std::f64::consts::TAU + 0.5),
            Self::NowAndThen => size * f64::from(u8::from(number % 10 == 3)),
            Self::InTurn => size * if number.is_multiple_of(2) { 1.0 } else { -1.0 },
        }
    }
}
