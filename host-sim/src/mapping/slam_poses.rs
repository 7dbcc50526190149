//! Poses of a drive through an unknown hall.

use agv_core::geometry::Pose;

use super::known_poses::by_odometry;
use super::pose_graph::PoseGraphError;
use super::simultaneous_scan::simultaneous;
use super::slam::{SlamMap, SlamParameters, map};
use crate::recording::{RecordedEvent, Recording, Truth, truth_at};
use crate::replay::{ReplayError, replay};

/// Why the poses cannot be found.
#[derive(Debug, thiserror::Error)]
pub enum SlamPosesError {
    /// The recording cannot be replayed.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// The poses contradict each other beyond repair.
    #[error(transparent)]
    PoseGraph(#[from] PoseGraphError),
}

/// Poses of R over the whole drive, from its odometry, its scans, and the loops that are recognised; no landmark is known.
/// The drive starts where the recording says, or at the origin.
///
/// # Errors
/// See [`SlamPosesError`].
pub fn slam_poses(
    recording: &Recording,
    parameters: &SlamParameters,
    done: impl Fn(),
) -> Result<(Vec<Truth>, SlamMap), SlamPosesError> {
    let start = recording.events.iter().find_map(|event| match event {
        RecordedEvent::SetPose(fix) => Some(fix.pose),
        _ => None,
    });
    let odometry = odometry(recording, start.unwrap_or_default())?;
    let laser = *recording.parameters.lasers.first();
    let scans: Vec<_> = recording
        .events
        .iter()
        .filter_map(|event| match event {
            RecordedEvent::Scan(scan) => {
                let scan = simultaneous(scan, &odometry, &laser)?;
                let pose = truth_at(&odometry, scan.start)?.compose(&laser);
                Some((scan, pose))
            }
            _ => None,
        })
        .collect();
    let scans: Vec<_> = scans.iter().map(|(scan, pose)| (scan, *pose)).collect();
    let map = map(&scans, parameters, done)?;
    let poses = corrected(&odometry, &map, &laser);
    Ok((poses, map))
}

fn odometry(recording: &Recording, start: Pose) -> Result<Vec<Truth>, ReplayError> {
    let mut poses: Vec<Truth> = Vec::new();
    for output in replay(&by_odometry(recording, start), |_| {})?.poses {
        if poses.last().is_none_or(|last| output.time > last.time) {
            poses.push(Truth { time: output.time, pose: output.pose });
        }
    }
    Ok(poses)
}

/// Odometry between key scans, led from each to the next; before the first and after the last it goes on alone.
fn corrected(odometry: &[Truth], map: &SlamMap, laser: &Pose) -> Vec<Truth> {
    let in_reverse = laser.inverse();
    let keys: Vec<_> = map
        .keys
        .iter()
        .zip(&map.poses)
        .map(|(key, pose)| (key.time, key.odometry.compose(&in_reverse), pose.compose(&in_reverse)))
        .collect();
    let lead = |sample: &Truth| {
        let after = keys.partition_point(|(time, _, _)| *time <= sample.time);
        let before = keys.get(after.saturating_sub(1))?;
        let pose = before.2.compose(&before.1.between(&sample.pose));
        let error = keys.get(after).filter(|_| after > 0).map(|next| {
            let share = sample.time.since(before.0) / next.0.since(before.0);
            before.2.compose(&before.1.between(&next.1)).between(&next.2).fraction(share)
        });
        Some(Truth { time: sample.time, pose: pose.compose(&error.unwrap_or_default()) })
    };
    odometry.iter().filter_map(lead).collect()
}
