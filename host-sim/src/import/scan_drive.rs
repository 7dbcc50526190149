//! A drive from a log of scans.

use agv_core::geometry::Pose;
use agv_core::localizer::Parameters;
use agv_core::measurement::PoseIncrement;
use agv_core::odometry::Vehicle;

use super::{PosedScan, ScanLog};
use crate::recording::{RecordedEvent, Recording, Reference};

/// A vehicle that reports increments of its pose, its scans in order of time, and the poses that the log gives to the
/// laser as references. None if there are no scans.
///
/// A log without odometry, as a pose graph is, gets the differences of its corrected poses as increments: a drive with
/// perfect odometry, good for maps and features, no measure of a localiser.
#[must_use]
pub fn drive(log: &ScanLog) -> Option<Recording> {
    let first = log.scans.first()?;
    let between_scans;
    let increments = if log.increments.is_empty() {
        between_scans = increments_of_poses(&log.scans);
        &between_scans
    } else {
        &log.increments
    };
    let mut events = Vec::with_capacity(increments.len() + log.scans.len());
    let mut increments = increments.iter().peekable();
    for posed in &log.scans {
        while let Some(increment) = increments.next_if(|increment| increment.time <= posed.scan.start) {
            events.push(RecordedEvent::Increment(*increment));
        }
        events.push(RecordedEvent::Scan(posed.scan.clone()));
    }
    events.extend(increments.map(|increment| RecordedEvent::Increment(*increment)));
    let reference = |posed: &PosedScan| Reference {
        time: posed.scan.start,
        x: posed.laser.x,
        y: posed.laser.y,
        heading: Some(posed.laser.theta),
    };
    let mut parameters = Parameters::new(Vehicle::Increments, first.robot.between(&first.laser));
    // An increment is all that lies between two poses, however long that took.
    parameters.limits.longest_extrapolation = LONGEST_EXTRAPOLATION;
    Some(Recording {
        parameters,
        landmarks: Vec::new(),
        events,
        truth: Vec::new(),
        references: log.scans.iter().map(reference).collect(),
        state: None,
    })
}

/// As long as can be set, s.
const LONGEST_EXTRAPOLATION: f64 = 10.0;

fn increments_of_poses(scans: &[PosedScan]) -> Vec<PoseIncrement> {
    let start = scans.first().map(|first| PoseIncrement { time: first.scan.start, displacement: Pose::default() });
    let steps = scans
        .windows(2)
        .map(|pair| PoseIncrement { time: pair[1].scan.start, displacement: pair[0].robot.between(&pair[1].robot) });
    start.into_iter().chain(steps).collect()
}
