//! Maps from drives whose poses are known, or found by the way.

mod clustering;
pub mod contour_file;
pub mod contour_mapper;
mod known_poses;
pub mod map_file;
pub mod odometry_noise;
pub mod pose_graph;
mod simultaneous_scan;
pub mod slam;
mod slam_poses;

pub use clustering::{Clustering, Sighting, cluster};
pub use known_poses::odometry_poses;
pub use slam_poses::{SlamPosesError, slam_poses};

use agv_core::localizer::{MapUse, Mode, PoseOutput};
use agv_core::maps::{Landmark, LandmarkKind};

use crate::recording::{Recording, Truth};
use crate::replay::{ReplayError, replay};

/// Builds a map of natural features (K 5.6): the drive is localised by its reflectors, the features of each scan are
/// put where they were seen from, and the centres of dense clusters become landmarks.
///
/// # Errors
/// [`ReplayError`] if the recording cannot be replayed.
pub fn map_features(recording: &Recording, clustering: &Clustering) -> Result<Vec<Landmark>, ReplayError> {
    let mut recording = recording.clone();
    recording.landmarks.retain(|landmark| landmark.kind == LandmarkKind::Reflector);
    // Features are looked for, but there is no map that they could correct the pose with.
    recording.parameters.maps = MapUse { reflectors: true, features: true, dynamic: false, slam: false };
    let replay = replay(&recording, |_| {})?;
    let mut reliable = replay.poses.iter().filter(|pose| pose.mode == Mode::Reflectors).peekable();
    let features = replay.uses.iter().filter(|used| used.kind != LandmarkKind::Reflector);
    let sightings = features.filter_map(|used| {
        while reliable.next_if(|pose| pose.time < used.time).is_some() {}
        let pose = reliable.peek().filter(|pose| pose.time.since(used.time) < LONGEST_WAIT)?;
        let pose_variance = variance_from_pose(pose, &used.located);
        Some(Sighting { kind: used.kind, position: used.located.into(), pose_variance })
    });
    Ok(cluster(sightings, clustering))
}

/// A feature counts if the vehicle knew by reflectors where it was within this time after, s.
const LONGEST_WAIT: f64 = 0.5;

/// Variance an axis of a point in W that was seen from an uncertain pose, m^2: half the trace of the first-order
/// covariance.
fn variance_from_pose(pose: &PoseOutput, located: &[f64; 2]) -> f64 {
    let [xx, _, yy, xt, yt, tt] = pose.covariance;
    let (dx, dy) = (located[0] - pose.pose.x, located[1] - pose.pose.y);
    0.5 * (xx + yy + (dx * dx + dy * dy) * tt) - dy * xt + dx * yt
}

/// Where the vehicle was while reflectors told it.
///
/// # Errors
/// [`ReplayError`] if the recording cannot be replayed.
pub fn poses_by_reflectors(recording: &Recording) -> Result<Vec<Truth>, ReplayError> {
    let mut recording = recording.clone();
    recording.landmarks.retain(|landmark| landmark.kind == LandmarkKind::Reflector);
    recording.parameters.maps = MapUse { reflectors: true, features: false, dynamic: false, slam: false };
    let replay = replay(&recording, |_| {})?;
    let reliable = replay.poses.iter().filter(|pose| pose.mode == Mode::Reflectors);
    let mut poses: Vec<Truth> = reliable.map(|pose| Truth { time: pose.time, pose: pose.pose }).collect();
    // Of outputs for the same time the last one has seen most.
    poses.reverse();
    poses.dedup_by_key(|pose| pose.time);
    poses.reverse();
    Ok(poses)
}

/// Builds a map of natural features from scans whose poses of R are known.
///
/// # Errors
/// [`ReplayError`] if the recording cannot be replayed.
pub fn map_features_at(
    recording: &Recording,
    poses: &[Truth],
    clustering: &Clustering,
) -> Result<Vec<Landmark>, ReplayError> {
    let sightings = known_poses::sightings(recording, poses, |kind| kind != LandmarkKind::Reflector)?;
    Ok(cluster(sightings, clustering))
}

/// What makes a cluster of observations a reflector: reflectors stand far apart, and directions to distant ones scatter.
#[must_use]
pub fn reflector_clustering() -> Clustering {
    Clustering { radius: 0.2, least_points: 10, largest_deviation: 0.06, deviation_share: 0.2 }
}

/// Builds a map of the reflectors that were seen from known poses of R.
///
/// # Errors
/// [`ReplayError`] if the recording cannot be replayed.
pub fn map_reflectors_at(
    recording: &Recording,
    poses: &[Truth],
    clustering: &Clustering,
) -> Result<Vec<Landmark>, ReplayError> {
    let sightings = known_poses::sightings(recording, poses, |kind| kind == LandmarkKind::Reflector)?;
    Ok(cluster(sightings, clustering))
}
