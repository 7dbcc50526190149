//! Scans with the poses at which somebody else says that they were taken.

use agv_core::geometry::Pose;
use agv_core::measurement::PoseIncrement;

use crate::recording::{RecordedEvent, RecordedScan, Recording, truth_at};

/// Beams of the longest scan that is looked at.
pub const BEAMS: usize = 1440;
/// Keypoints of one scan that are kept.
pub const KEYPOINTS: usize = 256;
/// Ranges outside this interval are absent, m.
pub const RANGES: (f32, f32) = (0.02, 80.0);

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

impl PosedScan {
    /// The scans of a recording, where its true poses say that the first beam was taken, or else its references.
    #[must_use]
    pub fn of_recording(recording: &Recording) -> Vec<Self> {
        let poses = if recording.truth.is_empty() { recording.referenced_poses() } else { recording.truth.clone() };
        let scans = recording.events.iter().filter_map(|event| match event {
            RecordedEvent::Scan(scan) => Some(scan),
            _ => None,
        });
        let posed = scans.filter_map(|scan| {
            let robot = truth_at(&poses, scan.start)?;
            Some(Self { scan: scan.clone(), laser: robot.compose(recording.parameters.lasers.first()), robot })
        });
        posed.collect()
    }
}

/// What a log of scans holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScanLog {
    /// Scans in order of the file.
    pub scans: Vec<PosedScan>,
    /// Motion that the robot's own odometry reported, in order of the file; empty if the log has none.
    pub increments: Vec<PoseIncrement>,
}
