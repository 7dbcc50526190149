//! Following a drive by the contours of the way behind, with the code of the vehicle.

use agv_core::contours::{ContourMatcher, Prediction};
use agv_core::geometry::Pose;
use agv_core::sensing::PointScan;
use agv_host_sim::import::{BEAMS, RANGES};

use super::slam::OfficeDrive;

/// What became of a window.
pub(super) struct Followed {
    /// Pose of the laser at each scan.
    pub(super) poses: Vec<Pose>,
    /// Whether the last scan said nothing.
    pub(super) is_lost: bool,
}

/// Follows a window from the corrected pose of its first scan on; `steps` are those of the odometry.
pub(super) fn follow(drive: &OfficeDrive, (first, _): (usize, usize), steps: &[Pose]) -> Followed {
    let mut matcher: Box<ContourMatcher> = Box::default();
    let mut points: Box<PointScan<BEAMS>> = Box::default();
    let mut pose = drive.truth[first];
    let mut see = |matcher: &mut ContourMatcher, scan: usize| {
        points.set(&drive.scans[scan].view(), RANGES.0, RANGES.1);
        matcher.see(points.view());
    };
    see(&mut matcher, first);
    matcher.keep(&pose);
    let mut followed = Followed { poses: vec![pose], is_lost: false };
    for (step, scan) in steps.iter().zip(first + 1..) {
        see(&mut matcher, scan);
        let predicted = Prediction::by_odometry(&pose, step);
        let found = matcher.align(&predicted);
        followed.is_lost = found.is_none();
        pose = found.map_or(predicted.pose, |found| found.pose);
        matcher.keep(&pose);
        followed.poses.push(pose);
    }
    followed
}
