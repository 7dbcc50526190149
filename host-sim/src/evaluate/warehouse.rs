//! The standard block storage: how precisely a vehicle ends its way in a lane between pallets.
//!
//! Each run is a world of its own, with a drive of its own. The localiser gets a start pose with the errors that a start
//! at reflectors leaves, and one of several maps. Errors are those of the logical point at the end of the way.

use agv_core::localizer::MapUse;
use rayon::prelude::*;
use serde::Serialize;

use super::accuracy::{PoseError, Spread, pose_error};
use crate::mapping::{Clustering, map_features};
use crate::replay::{ReplayError, replay};
use crate::simulate::block_storage::ReflectorPlacement;
use crate::simulate::scenario::{PathKind, Scenario, WorldOptions};
use crate::simulate::{SimulateError, simulate};

/// Which landmarks the localiser may use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Map {
    /// None.
    Odometry,
    /// Surveyed reflectors, in the aisle and at the end of the lane.
    Reflectors,
    /// Features mapped by a drive on another path.
    Static,
    /// Features found while driving.
    Dynamic,
    /// Surveyed reflectors and features mapped on another path.
    Mixed,
}

impl Map {
    /// All maps.
    pub const ALL: [Self; 5] = [Self::Odometry, Self::Reflectors, Self::Static, Self::Dynamic, Self::Mixed];

    /// Whether there are reflectors in the world: as landmarks, or to map by.
    fn needs_reflectors(self) -> bool {
        self.uses_reflectors() || self.has_static_features()
    }

    fn uses_reflectors(self) -> bool {
        matches!(self, Self::Reflectors | Self::Mixed)
    }

    fn has_static_features(self) -> bool {
        matches!(self, Self::Static | Self::Mixed)
    }
}

/// One experiment: a path with a map.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Experiment {
    /// Name.
    pub name: String,
    /// Which landmarks the localiser may use.
    pub map: Map,
    /// Length of the way, m.
    pub path_m: f64,
    /// Number of runs.
    pub runs: usize,
    /// Share of the runs that end within 2 cm and 0.1 deg.
    pub ok_share: f64,
    /// Distance from the true position at the end, mm.
    pub position_mm: Spread,
    /// Distance from the true heading at the end, deg.
    pub heading_deg: Spread,
    /// Mean normalised error squared at the end; 3 is expected.
    pub nees: f64,
    /// Recorded time by processor time.
    pub realtime_factor: f64,
}

/// Why the experiment cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum WarehouseError {
    /// A drive cannot be simulated.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// A drive cannot be replayed.
    #[error(transparent)]
    Replay(#[from] ReplayError),
}

/// The four paths of K table 5.6.
pub const PATHS: [(&str, PathKind); 4] =
    [("P1", PathKind::P1), ("P2", PathKind::P2), ("P3", PathKind::P3), ("P4", PathKind::P4)];

/// Largest error of a position that can still be worked with, m (K 5.6).
const POSITION_REQUIREMENT: f64 = 0.02;

/// Largest error of a heading that can still be worked with, rad (K 5.6).
const HEADING_REQUIREMENT: f64 = 0.1 * std::f64::consts::PI / 180.0;

/// End of one run.
struct Run {
    error: PoseError,
    path: f64,
    recorded: f64,
    elapsed: f64,
}

/// Runs one experiment with seeds 1 to `runs`; `done` is called after each run.
///
/// # Errors
/// See [`WarehouseError`].
pub fn experiment(
    (name, path): (&str, PathKind),
    map: Map,
    runs: usize,
    done: impl Fn() + Sync,
) -> Result<Experiment, WarehouseError> {
    let results: Vec<Run> = (1..=runs as u64)
        .into_par_iter()
        .map(|seed| {
            let run = run(path, map, seed);
            done();
            run
        })
        .collect::<Result<_, _>>()?;
    let is_ok =
        |run: &&Run| run.error.position <= POSITION_REQUIREMENT && run.error.heading.abs() <= HEADING_REQUIREMENT;
    let sum = |value: fn(&Run) -> f64| results.iter().map(value).sum::<f64>();
    Ok(Experiment {
        name: name.to_owned(),
        map,
        path_m: sum(|run| run.path) / runs as f64,
        runs,
        ok_share: results.iter().filter(is_ok).count() as f64 / runs as f64,
        position_mm: Spread::of(results.iter().map(|run| run.error.position * 1e3)),
        heading_deg: Spread::of(results.iter().map(|run| run.error.heading.abs().to_degrees())),
        nees: sum(|run| run.error.normalised_square.unwrap_or(f64::INFINITY)) / runs as f64,
        realtime_factor: sum(|run| run.recorded) / sum(|run| run.elapsed),
    })
}

/// The standard scenario of a path with what the map needs of the world.
#[must_use]
pub fn scenario(path: PathKind, map: Map, seed: u64) -> Scenario {
    let mut scenario = Scenario { seed, ..Scenario::default() };
    scenario.path.kind = path;
    if let WorldOptions::BlockStorage(storage) = &mut scenario.world
        && map.needs_reflectors()
    {
        storage.reflectors = ReflectorPlacement::AisleAndLaneEnd;
    }
    scenario
}

fn run(path: PathKind, map: Map, seed: u64) -> Result<Run, WarehouseError> {
    let simulation = simulate(&scenario(path, map, seed))?;
    let mut recording = simulation.recording;
    recording.parameters.maps =
        MapUse { reflectors: map.uses_reflectors(), features: map.has_static_features(), dynamic: map == Map::Dynamic };
    if map.has_static_features() {
        let mapping = simulate(&scenario(PathKind::Mapping, map, seed))?.recording;
        recording.landmarks.extend(map_features(&mapping, &Clustering::default())?);
    }
    let replay = replay(&recording, |_| {})?;
    let error = replay.poses.iter().rev().find_map(|pose| pose_error(pose, &recording.truth)).unwrap_or(PoseError {
        time: simulation_end(&recording),
        position: f64::INFINITY,
        heading: f64::INFINITY,
        normalised_square: None,
    });
    let recorded = match (recording.truth.first(), recording.truth.last()) {
        (Some(first), Some(last)) => last.time.since(first.time),
        _ => 0.0,
    };
    Ok(Run { error, path: simulation.path.length(), recorded, elapsed: replay.elapsed.as_secs_f64() })
}

fn simulation_end(recording: &crate::recording::Recording) -> agv_core::measurement::Time {
    recording.truth.last().map_or_else(Default::default, |truth| truth.time)
}
