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
    /// Landmarks alone: the odometry is not believed. Between landmarks the vehicle is assumed to go on as it did,
    /// with an uncertainty that soon makes the pose useless; the vehicle should stop.
    WithoutOdometry,
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
    /// The encoder of the driving wheel has a fault.
    DriveEncoder,
    /// The encoder of the steering has a fault.
    SteeringEncoder,
}
