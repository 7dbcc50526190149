//! What the pose rests on.

use serde::{Deserialize, Serialize};

/// What the pose rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// No pose has been given yet.
    NotLocalised,
    /// Reflectors.
    Reflectors,
    /// Natural features.
    Features,
    /// Reflectors and natural features.
    Mixed,
    /// Odometry alone, since more than the tolerated distance.
    DeadReckoning,
    /// The pose is wrong or too uncertain; it must be given again.
    Lost,
}

/// Why the mode is what it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// Nothing is the matter.
    None,
    /// Nobody has said where the vehicle is.
    NoPose,
    /// No landmark has corrected the pose lately.
    NoLandmarks,
    /// Most observations fit no landmark of the map.
    LandmarksRejected,
    /// Innovations are larger than the filter believes.
    InnovationsTooLarge,
    /// The standard deviation is above its limit.
    Uncertain,
    /// The odometry reported a motion that is not possible.
    OdometryImplausible,
}
