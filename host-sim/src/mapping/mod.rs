//! Maps from drives whose poses are known.

mod clustering;
mod known_poses;
pub mod map_file;

pub use clustering::{Clustering, Sighting, cluster};
pub use known_poses::referenced_poses;

use agv_core::landmarks::{Landmark, LandmarkKind};
use agv_core::localizer::{MapUse, Mode};

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
    recording.parameters.maps = MapUse { reflectors: true, features: true, dynamic: false };
    let replay = replay(&recording, |_| {})?;
    let mut reliable = replay.poses.iter().filter(|pose| pose.mode == Mode::Reflectors).peekable();
    let sightings = replay.uses.iter().filter(|used| used.kind != LandmarkKind::Reflector).filter(|used| {
        while reliable.next_if(|pose| pose.time < used.time).is_some() {}
        reliable.peek().is_some_and(|pose| pose.time.since(used.time) < 0.5)
    });
    Ok(cluster(sightings.map(|used| Sighting { kind: used.kind, position: used.located.into() }), clustering))
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
