//! A vehicle that is switched on in the standard block storage, where it knows a map of natural features only.
//!
//! The map comes from another drive on another path. Landmarks look alike: corners and ends of faces are found as
//! reflectors are, by their distances.

use agv_core::geometry::Pose;
use agv_core::localizer::Parameters;
use agv_core::maps::{Landmark, LandmarkKind};
use agv_core::relocalization::{ReflectorRelocalizer, ReflectorSnapshot, RelocalizationParameters};
use agv_core::sensing::falko::Detector;
use agv_core::sensing::{Keypoint, PointScan};
use rayon::prelude::*;

use super::{Outcome, REVOLUTIONS, SearchedMap, Start, outcome, search};
use crate::equipment::Equipment;
use crate::evaluate::falko::{BEAMS, KEYPOINTS};
use crate::evaluate::warehouse::{Map, Method, PATHS, WarehouseError, prepare};
use crate::evaluate::warehouse_disturbance::Disturbance;
use agv_host_sim::simulate::Simulation;
use agv_host_sim::simulate::laser::{LaserTrack, Revolution, Scene, scan};
use agv_host_sim::simulate::random::{Random, Stream};
use agv_host_sim::simulate::raycast::RayCaster;
use agv_host_sim::simulate::scenario::LaserOptions;

/// Starts in one storage.
const STARTS_A_STORAGE: u64 = 20;

/// A vehicle may stand beside its path, m, and askew, rad; half of them face the other way.
const BESIDE: f64 = 0.15;
const ASKEW: f64 = 0.1;

/// When a pose among features is believed: many landmarks are seen together, and many of those that are seen are not in
/// the map.
#[must_use]
pub fn parameters() -> RelocalizationParameters {
    RelocalizationParameters { fewest: 5, ..RelocalizationParameters::default() }
}

/// Simulates `starts` starts from a seed on; `done` is called after each.
///
/// # Errors
/// If a storage cannot be mapped.
pub fn run(
    seed: u64,
    starts: u64,
    parameters: &RelocalizationParameters,
    done: impl Fn() + Sync,
) -> Result<Outcome, WarehouseError> {
    let method = Method::ALL.into_iter().find(|method| method.map == Map::Static);
    let Some(method) = method else { return Ok(outcome("block storage, features", Vec::new())) };
    let storages = starts.div_ceil(STARTS_A_STORAGE);
    let results: Vec<Vec<Start>> = (0..storages)
        .into_par_iter()
        .map(|number| {
            let seed = seed.wrapping_mul(1_000_003).wrapping_add(number);
            let simulation = prepare(PATHS[0].1, &method, Disturbance::None, Equipment::default(), seed)?;
            let count = STARTS_A_STORAGE.min(starts - number * STARTS_A_STORAGE);
            Ok(run_storage(&simulation, seed, count, parameters, &done))
        })
        .collect::<Result<_, WarehouseError>>()?;
    Ok(outcome("block storage, features", results.into_iter().flatten().collect()))
}

fn run_storage(
    simulation: &Simulation,
    seed: u64,
    starts: u64,
    parameters: &RelocalizationParameters,
    done: &(impl Fn() + Sync),
) -> Vec<Start> {
    let recording = &simulation.recording;
    let is_feature = |landmark: &&Landmark| landmark.kind != LandmarkKind::Reflector;
    let features: Vec<Landmark> = recording.landmarks.iter().filter(is_feature).copied().collect();
    let map = SearchedMap::new(&features);
    let caster = RayCaster::new(&simulation.world);
    let mut random = Random::new(seed, Stream::Kidnapping);
    let mut sensor = Sensor::new(&recording.parameters, simulation.true_laser, &caster);
    let mut relocalizer = Box::new(ReflectorRelocalizer::<64>::new(*parameters));
    (0..starts)
        .map(|_| {
            let truth = anywhere(&mut random);
            let mut snapshot = ReflectorSnapshot::<64>::new();
            let mut start = Start::default();
            for revolution in 0..REVOLUTIONS {
                let seen = sensor.look(&truth, &mut snapshot, &mut random);
                if revolution == 0 {
                    start.seen = seen;
                }
                if search(&mut start, revolution, &truth, &snapshot, &map.view(), &mut relocalizer, true) {
                    break;
                }
            }
            done();
            start
        })
        .collect()
}

/// A pose on or beside one of the paths.
fn anywhere(random: &mut Random) -> Pose {
    let path = PATHS[((random.uniform() * PATHS.len() as f64) as usize).min(PATHS.len() - 1)].1.path();
    let way = random.between(0.0, path.length());
    let on_path = path.legs.first().map_or(path.start, |leg| leg.pose(&path.start, way));
    let turn = if random.happens(0.5) { std::f64::consts::PI } else { 0.0 };
    let beside = Pose::new(0.0, random.between(-BESIDE, BESIDE), turn + random.between(-ASKEW, ASKEW));
    on_path.compose(&beside)
}

/// The laser of a standing vehicle, and what is found in its scans.
struct Sensor<'a> {
    believed: &'a Parameters,
    true_laser: Pose,
    caster: &'a RayCaster,
    detector: Box<Detector<BEAMS>>,
    points: Box<PointScan<BEAMS>>,
    found: heapless::Vec<Keypoint, KEYPOINTS>,
}

impl<'a> Sensor<'a> {
    fn new(believed: &'a Parameters, true_laser: Pose, caster: &'a RayCaster) -> Self {
        Self {
            believed,
            true_laser,
            caster,
            detector: Box::new(Detector::new(believed.features.detector)),
            points: Box::new(PointScan::new()),
            found: heapless::Vec::new(),
        }
    }

    /// Adds the features of one revolution to the snapshot, in R, and returns their number.
    fn look(&mut self, truth: &Pose, snapshot: &mut ReflectorSnapshot<64>, random: &mut Random) -> usize {
        let track = LaserTrack::standing(&truth.compose(&self.true_laser));
        let revolution = Revolution {
            index: 0,
            scene: Scene { fixed: self.caster, people: &[] },
            track: &track,
            options: &LaserOptions::default(),
            drive_start: Default::default(),
        };
        let scan = scan(&revolution, random, &mut Random::new(0, Stream::LaserFaults));
        let features = &self.believed.features;
        self.points.set(&scan.view(), features.nearest, features.farthest);
        self.detector.detect(&self.points, &mut self.found);
        let added = (features.added_deviation * features.added_deviation) as f32;
        for keypoint in &self.found {
            let [xx, _, yy] = keypoint.covariance;
            let position = self.believed.lasers.first().transform(&keypoint.position.cast());
            snapshot.see_landmark(&position, 0.5 * (xx + yy) + added);
        }
        self.found.len()
    }
}
