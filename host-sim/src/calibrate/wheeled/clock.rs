//! The odometry's clock against that of the poses.

use serde::Serialize;

/// How the clock of the odometry runs: what it did at time `t` of its own is true at `t + offset + rate * t` of the poses' clock,
/// counted from the first pose of the drive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Clock {
    /// How much later the poses' clock says it, s.
    pub offset_s: f64,
    /// How much more, for each second.
    pub rate: f64,
}

impl Clock {
    /// The time of the odometry at a time of the poses, s since the first pose.
    #[must_use]
    pub fn odometry_time(&self, pose_time: f64) -> f64 {
        pose_time - self.offset_s - self.rate * pose_time
    }
}
