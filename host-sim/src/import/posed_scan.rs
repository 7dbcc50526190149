//! Scans with the poses at which somebody else says that they were taken.

use agv_core::geometry::Pose;
use agv_core::measurement::PoseIncrement;

use crate::recording::RecordedScan;

/// A scan and where the laser was.
#[derive(Clone, Debug, PartialEq)]
pub struct PosedScan {
    /// The scan in the frame of the laser.
    pub scan: RecordedScan,
    /// Pose of the laser in the frame of the log; corrected if the log is.
    pub laser: Pose,
    /// Pose of the robot in the same frame.
    pub robot: Pose,
}

/// What a log of scans holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScanLog {
    /// Scans in order of the file.
    pub scans: Vec<PosedScan>,
    /// Motion that the robot's own odometry reported, in order of the file; empty if the log has none.
    pub increments: Vec<PoseIncrement>,
}
