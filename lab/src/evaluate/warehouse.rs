//! The standard block storage: how precisely a vehicle ends its way in a lane between pallets.
//!
//! Each run is a world of its own, with a drive of its own. The localiser gets a start pose with the errors that a start
//! at reflectors leaves, and one of several maps. Errors are those of the logical point at the end of the way.

use std::ops::Range;

use agv_core::localizer::MapUse;
use agv_core::sensing::falko;
use agv_core::sources::Switches;
use rayon::prelude::*;
use serde::Serialize;

use super::warehouse_disturbance::Disturbance;
use crate::equipment::Equipment;
use agv_host_sim::accuracy::{HEADING_REQUIREMENT, POSITION_REQUIREMENT, PoseError, Spread, pose_error};
use agv_host_sim::mapping::{Clustering, map_features};
use agv_host_sim::replay::{ReplayError, replay};
use agv_host_sim::simulate::block_storage::{BlockStoragePath, ReflectorPlacement};
use agv_host_sim::simulate::scenario::{Scenario, WorldOptions};
use agv_host_sim::simulate::{SimulateError, Simulation, simulate};

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
    /// Features found while driving, Algorithm 1 (K 5.4.1).
    Dynamic,
    /// Contours of the way behind, as the vehicle ships.
    Slam,
    /// Features found while driving, in the state of the filter, and alignment to key scans.
    SlamFeaturesAndKeyScans,
    /// Features alone.
    SlamFeatures,
    /// Corners alone.
    SlamCorners,
    /// Alignment to key scans, and no features.
    SlamKeyScans,
    /// Features mapped by a drive on another path, and all of [`Map::Slam`].
    StaticSlam,
    /// Surveyed reflectors and features mapped on another path.
    Mixed,
}

impl Map {
    /// Whether there are reflectors in the world: as landmarks, or to map by.
    fn needs_reflectors(self) -> bool {
        self.uses_reflectors() || self.has_static_features()
    }

    fn uses_reflectors(self) -> bool {
        matches!(self, Self::Reflectors | Self::Mixed)
    }

    fn has_static_features(self) -> bool {
        matches!(self, Self::Static | Self::Mixed | Self::StaticSlam)
    }

    fn is_slam(self) -> bool {
        self.has_contours()
            || matches!(
                self,
                Self::SlamFeatures | Self::SlamCorners | Self::SlamKeyScans | Self::SlamFeaturesAndKeyScans
            )
    }

    fn has_key_scans(self) -> bool {
        matches!(self, Self::SlamKeyScans | Self::SlamFeaturesAndKeyScans)
    }

    fn has_contours(self) -> bool {
        matches!(self, Self::Slam | Self::StaticSlam)
    }
}

/// How the vehicle localises.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Method {
    /// Name.
    pub name: &'static str,
    /// Which landmarks it may use.
    pub map: Map,
    /// How it finds natural features.
    pub detector: falko::Parameters,
    /// Standard deviation that is added to what the detector states, m.
    pub added_deviation: f64,
    /// Which sources it may use, key scans aside.
    pub sources: Switches,
}

/// What [`falko::Parameters::mended`] keypoints scatter and wander with the viewpoint beyond what it states, m.
const MENDED_DEVIATION: f64 = 0.01;

/// The same for FALKO as printed: scatter and median drift that the feasibility study found, m.
const PRINTED_DEVIATION: f64 = 0.034;

/// Side slip of a vehicle whose lasting errors are estimated, m for a square root of a metre.
const SIDE_SLIP: f64 = 0.6e-3;

impl Method {
    /// All methods: every map with the default detector, and Algorithm 1 with FALKO as printed too.
    pub const ALL: [Self; 12] = [
        Self::mended("odometry", Map::Odometry),
        Self::mended("reflectors", Map::Reflectors),
        Self::mended("static", Map::Static),
        Self {
            name: "dynamic, FALKO as printed",
            map: Map::Dynamic,
            detector: falko::Parameters::thesis(),
            added_deviation: PRINTED_DEVIATION,
            sources: Switches::ALL,
        },
        Self::mended("dynamic", Map::Dynamic),
        Self {
            sources: Switches { end_points: false, ..Switches::ALL },
            ..Self::mended("slam with corners alone", Map::SlamCorners)
        },
        Self::mended("slam with features alone", Map::SlamFeatures),
        Self {
            sources: Switches { corners: false, end_points: false, ..Switches::ALL },
            ..Self::mended("slam with key scans alone", Map::SlamKeyScans)
        },
        Self::mended("slam with features and key scans", Map::SlamFeaturesAndKeyScans),
        Self::mended("slam", Map::Slam),
        Self::mended("static and slam", Map::StaticSlam),
        Self::mended("mixed", Map::Mixed),
    ];

    const fn mended(name: &'static str, map: Map) -> Self {
        Self {
            name,
            map,
            detector: falko::Parameters::mended(),
            added_deviation: MENDED_DEVIATION,
            sources: Switches::ALL,
        }
    }
}

/// One experiment: a path with a map.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Experiment {
    /// Name.
    pub name: String,
    /// Which landmarks the localiser may use.
    pub map: Map,
    /// In what the drive differs from the standard one.
    pub disturbance: Disturbance,
    /// The vehicle.
    #[serde(flatten)]
    pub equipment: Equipment,
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
pub const PATHS: [(&str, BlockStoragePath); 4] = [
    ("P1", BlockStoragePath::P1),
    ("P2", BlockStoragePath::P2),
    ("P3", BlockStoragePath::P3),
    ("P4", BlockStoragePath::P4),
];

/// The mapping drive has its own noise: the seed of a run with this bit changed.
const MAPPING_SEED_BIT: u64 = 1 << 32;

/// End of one run.
struct Run {
    error: PoseError,
    path: f64,
    recorded: f64,
    elapsed: f64,
}

/// Runs one experiment with each of the seeds; `done` is called after each run.
///
/// # Errors
/// See [`WarehouseError`].
pub fn experiment(
    (path_name, path): (&str, BlockStoragePath),
    method: &Method,
    (disturbance, equipment): (Disturbance, Equipment),
    seeds: Range<u64>,
    done: impl Fn() + Sync,
) -> Result<Experiment, WarehouseError> {
    let results: Vec<Run> = seeds
        .into_par_iter()
        .map(|seed| {
            let run = run(path, method, disturbance, equipment, seed);
            done();
            run
        })
        .collect::<Result<_, _>>()?;
    let is_ok =
        |run: &&Run| run.error.position <= POSITION_REQUIREMENT && run.error.heading.abs() <= HEADING_REQUIREMENT;
    let sum = |value: fn(&Run) -> f64| results.iter().map(value).sum::<f64>();
    let runs = results.len() as f64;
    Ok(Experiment {
        name: format!("{path_name} {}", method.name),
        map: method.map,
        disturbance,
        equipment,
        path_m: sum(|run| run.path) / runs,
        runs: results.len(),
        ok_share: results.iter().filter(is_ok).count() as f64 / runs,
        position_mm: Spread::of(results.iter().map(|run| run.error.position * 1e3)),
        heading_deg: Spread::of(results.iter().map(|run| run.error.heading.abs().to_degrees())),
        nees: sum(|run| run.error.normalised_square.unwrap_or(f64::INFINITY)) / runs,
        realtime_factor: sum(|run| run.recorded) / sum(|run| run.elapsed),
    })
}

/// What the localiser of one run is given: a drive and the map of the method. The world is that of the seed. Features
/// are mapped by another drive in the same world, on another path and with other noise, which is localised by the same
/// survey of the reflectors.
///
/// # Errors
/// See [`WarehouseError`].
pub fn prepare(
    path: BlockStoragePath,
    method: &Method,
    disturbance: Disturbance,
    equipment: Equipment,
    seed: u64,
) -> Result<Simulation, WarehouseError> {
    let mut drive = scenario(path, method.map, disturbance, seed, seed);
    equipment.apply(&mut drive);
    let mut simulation = simulate(&drive)?;
    let recording = &mut simulation.recording;
    recording.parameters.features.detector = method.detector;
    recording.parameters.features.added_deviation = method.added_deviation;
    recording.parameters.maps = MapUse {
        reflectors: method.map.uses_reflectors(),
        features: method.map.has_static_features(),
        dynamic: method.map == Map::Dynamic,
        slam: method.map.is_slam(),
    };
    if method.map.is_slam() {
        // Scale and steering offset are in the state, so the noise need not stand for them.
        recording.parameters.odometry_noise.side_slip = SIDE_SLIP;
    }
    recording.parameters.sources =
        Switches { key_scans: method.map.has_key_scans(), contours: method.map.has_contours(), ..method.sources };
    if method.map.has_static_features() {
        let mut mapping = scenario(
            BlockStoragePath::Mapping,
            method.map,
            disturbance.of_the_mapping_drive(),
            seed,
            seed ^ MAPPING_SEED_BIT,
        );
        equipment.apply(&mut mapping);
        let mut mapping = simulate(&mapping)?.recording;
        mapping.parameters.features.detector = method.detector;
        mapping.landmarks.clone_from(&recording.landmarks);
        recording.landmarks.extend(map_features(&mapping, &Clustering::default())?);
    }
    Ok(simulation)
}

fn scenario(path: BlockStoragePath, map: Map, disturbance: Disturbance, world_seed: u64, seed: u64) -> Scenario {
    let mut scenario = Scenario::block_storage(path, seed);
    if let WorldOptions::BlockStorage(storage) = &mut scenario.world {
        storage.seed = Some(world_seed);
        if map.needs_reflectors() {
            storage.reflectors = ReflectorPlacement::AisleAndLaneEnd;
        }
    }
    disturbance.apply(&mut scenario);
    scenario
}

fn run(
    path: BlockStoragePath,
    method: &Method,
    disturbance: Disturbance,
    equipment: Equipment,
    seed: u64,
) -> Result<Run, WarehouseError> {
    let simulation = prepare(path, method, disturbance, equipment, seed)?;
    let recording = &simulation.recording;
    let replay = replay(recording, |_| {})?;
    let last = replay.poses.iter().rev().find_map(|pose| pose_error(pose, &recording.truth));
    let recorded = match (recording.truth.first(), recording.truth.last()) {
        (Some(first), Some(last)) => last.time.since(first.time),
        _ => 0.0,
    };
    Ok(Run {
        error: last.unwrap_or(PoseError::UNKNOWN),
        path: simulation.path.length(),
        recorded,
        elapsed: replay.elapsed.as_secs_f64(),
    })
}
