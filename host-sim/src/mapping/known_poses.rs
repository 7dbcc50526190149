//! Sightings of landmarks from poses that another instrument has measured.

use agv_core::geometry::{Point, Pose};
use agv_core::localizer::{MapUse, PoseFix};
use agv_core::maps::LandmarkKind;

use super::Sighting;
use crate::recording::{RecordedEvent, Recording, Truth, truth_at};
use crate::replay::{ReplayError, replay};

/// Everything that is seen of the wanted kinds between the first and the last of the known poses, where it is as seen
/// from them. What stands in the recording's map does not matter.
///
/// # Errors
/// [`ReplayError`] if the recording cannot be replayed.
pub fn sightings(
    recording: &Recording,
    poses: &[Truth],
    is_wanted: impl Fn(LandmarkKind) -> bool,
) -> Result<Vec<Sighting>, ReplayError> {
    let Some(first) = poses.first() else {
        return Ok(Vec::new());
    };
    let replay = replay(&by_odometry(recording, first.pose), |_| {})?;
    let sightings = replay.uses.iter().filter(|used| is_wanted(used.kind)).filter_map(|used| {
        let laser = truth_at(poses, used.time)?.compose(recording.parameters.lasers.first());
        let [x, y] = used.position.map(f64::from);
        Some(Sighting { kind: used.kind, position: laser.transform(&Point::new(x, y)), pose_variance: 0.0 })
    });
    Ok(sightings.collect())
}

/// Where the odometry alone has the vehicle, from the origin on.
///
/// # Errors
/// [`ReplayError`] if the recording cannot be replayed.
pub fn odometry_poses(recording: &Recording) -> Result<Vec<Truth>, ReplayError> {
    let replay = replay(&by_odometry(recording, Pose::default()), |_| {})?;
    let mut poses: Vec<Truth> =
        replay.poses.iter().map(|output| Truth { time: output.time, pose: output.smooth }).collect();
    poses.dedup_by_key(|pose| pose.time);
    Ok(poses)
}

/// The recording without a map, from a start pose on. The localiser only finds the landmarks; it must not mind that its own
/// pose rests on odometry alone.
pub(super) fn by_odometry(recording: &Recording, pose: Pose) -> Recording {
    let mut recording = recording.clone();
    recording.landmarks.clear();
    recording.state = None;
    recording.events.retain(|event| !matches!(event, RecordedEvent::SetPose(_)));
    let start = recording.events.iter().filter_map(RecordedEvent::time).min().unwrap_or_default();
    let fix = PoseFix { time: start, pose, position_deviation: 0.0, heading_deviation: 0.0 };
    recording.events.insert(0, RecordedEvent::SetPose(fix));
    let parameters = &mut recording.parameters;
    parameters.maps = MapUse { reflectors: true, features: true, dynamic: false, slam: false };
    parameters.consistency.least_acceptance = 0.0;
    parameters.limits.lost_after = f64::INFINITY;
    parameters.limits.largest_position_deviation = f64::INFINITY;
    parameters.limits.largest_heading_deviation = f64::INFINITY;
    recording
}
