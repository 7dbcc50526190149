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
    /// Landmarks correct the pose, but something contradicts it: it may be further off than its covariance says, and the
    /// vehicle should stop or creep.
    Degraded,
}

impl Mode {
    /// Whether the pose rests on landmarks that nothing contradicts.
    #[must_use]
    pub const fn is_localised(self) -> bool {
        matches!(self, Self::Reflectors | Self::Features | Self::Mixed)
    }
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
    /// The laser has moved otherwise than the odometry says: the vehicle has slid or was carried, or the laser was knocked.
    MotionDisagrees,
    /// The laser is turned, or stands elsewhere on the vehicle than is believed.
    LaserMoved,
    /// The odometry's scale or steering is not what is believed; landmarks make up for it.
    OdometryDisagrees,
    /// The odometry says nothing, or nothing that the vehicle as it is described can say.
    OdometrySilent,
    /// Gyro and wheels tell different turns: a wheel slips, or the vehicle is turned while its wheels stand. The gyro is believed.
    WheelsSlip,
    /// The gyro is silent, frozen, at the end of its range, or tells another bias than before.
    GyroFault,
}
