//! A vehicle that localises by the clouds of a multi-beam lidar: halls in space, cast beam by beam, and the whole controller.
//!
//! A first drive makes the map: its clouds are projected as the bridge does it, at the true poses, into a map of contours, and every two
//! metres a place is stored. In the second drive, with noise of its own, the first cloud is looked for among the places, and the
//! pose is told to the controller; then its scans come over the NAV350 protocol. There are no reflectors. Defined before the runs:
//!
//! - poses are those that the controller would publish, a hundred a second, from one second after the vehicle drives off to the end;
//! - a pose is good within 10 mm and 0.1 deg of the truth of its time;
//! - a drive whose first cloud is not recognised has no good pose, and counts with as many poses as the others;
//! - the 95 % marks are over all poses of all drives that were localised.

use std::ops::Range;

use agv_core::geometry::{Pose, difference};
use agv_core::localizer::PoseFix;
use agv_core::measurement::Time;
use agv_host_sim::accuracy::quantile;
use agv_host_sim::contour_map::ContourMap;
use agv_host_sim::lidar3d::Revolution;
use agv_host_sim::lidar3d::cloud_speed::CloudSpeed;
use agv_host_sim::lidar3d::place_map::{PlaceMap, StoredPlace};
use agv_host_sim::lidar3d::place_search::PlaceSearch;
use agv_host_sim::lidar3d::projection::Projection;
use agv_host_sim::lidar3d::signatures::Signatures;
use agv_host_sim::lidar3d::spinning_lidar::SpinningLidar;
use agv_host_sim::lidar3d::view::{Standing, View};
use agv_host_sim::mapping::contour_mapper::{CELL, map_contours_at};
use agv_host_sim::recording::{RecordedEvent, Recording, truth_at};
use agv_host_sim::simulate::block_storage::BlockStorage;
use agv_host_sim::simulate::random::{Random, Stream};
use agv_host_sim::simulate::scenario::{PathKind, PoseOptions, Scenario, WorldOptions};
use agv_host_sim::simulate::storeys::Storeys;
use agv_host_sim::simulate::warehouse_hall::WarehouseHall;
use agv_host_sim::simulate::{START, SimulateError, simulate};
use agv_lidar3d::cloud::{Cloud, RingOrder};
use agv_lidar3d::place::Span;
use agv_wire::nav350::SensorFrame;
use nalgebra::Rotation3;
use serde::Serialize;

use crate::campaign::rig::{self, RigError, RigOptions};

/// A pose is good within these, m and rad.
const GOOD: (f64, f64) = (0.010, 0.1 * std::f64::consts::PI / 180.0);
/// Poses count from then on, s after the vehicle drives off.
const SETTLED: f64 = 1.0;
/// Distance between two places, m.
const SHIFT: f64 = 2.0;
/// Standard deviations that are told of the first pose, m and rad.
const FIRST: (f64, f64) = (0.2, std::f64::consts::PI / 180.0);
/// The first drive has its own noise: the seed of a run with this bit changed.
const MAPPING_SEED_BIT: u64 = 1 << 32;

/// Why it cannot be measured.
#[derive(Debug, thiserror::Error)]
pub enum CloudDriveError {
    /// The scenario makes no sense.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// The controller cannot be driven.
    #[error(transparent)]
    Rig(#[from] RigError),
}

/// Where the vehicle drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Site {
    /// The standard hall, 90 m round a double rack.
    Hall,
    /// The standard block storage, 12 m into the lane; mapped on another way.
    BlockStorage,
}

/// With which sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SensorKind {
    /// 16 rings, a VLP-16.
    Vlp16,
    /// 64 rings, an HDL-64E.
    Hdl64e,
}

/// What became of the drives.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CloudDrives {
    /// Where.
    pub site: Site,
    /// With which sensor.
    pub sensor: SensorKind,
    /// Drives.
    pub drives: usize,
    /// Drives whose first cloud was recognised at the right place, and at a wrong one.
    pub recognised: usize,
    /// See `recognised`.
    pub wrong_starts: usize,
    /// Error of the first pose, the worst, m.
    pub start_worst_m: f64,
    /// Share of the poses that are within 10 mm and 0.1 deg.
    pub good_share: f64,
    /// The same of the worst drive, and its seed.
    pub worst_drive_share: f64,
    /// See `worst_drive_share`.
    pub worst_drive_seed: u64,
    /// Distance from the truth, mm: median, 95 % mark, largest.
    pub position_mm: [f64; 3],
    /// Difference from its heading, deg: median, 95 % mark, largest.
    pub heading_deg: [f64; 3],
    /// Seed of the largest distance.
    pub worst_seed: u64,
    /// Poses that count.
    pub poses: usize,
}

/// Errors of one drive.
struct Run {
    seed: u64,
    /// Error of the first pose, m; None if the place was not recognised.
    start: Option<f64>,
    /// m and rad.
    errors: Vec<(f64, f64)>,
}

/// Drives once with each seed, for at most so many seconds; `done` is called after each.
///
/// # Errors
/// See [`CloudDriveError`].
pub fn cloud_drives(
    site: Site,
    sensor: SensorKind,
    seconds: Option<f64>,
    seeds: Range<u64>,
    mut done: impl FnMut(),
) -> Result<CloudDrives, CloudDriveError> {
    let mut runs = Vec::new();
    for seed in seeds {
        runs.push(run(site, sensor, seconds, seed)?);
        done();
    }
    Ok(summary(site, sensor, &runs))
}

fn summary(site: Site, sensor: SensorKind, runs: &[Run]) -> CloudDrives {
    let is_good = |error: &&(f64, f64)| error.0 <= GOOD.0 && error.1 <= GOOD.1;
    let errors: Vec<(f64, f64)> = runs.iter().flat_map(|run| run.errors.iter().copied()).collect();
    let longest = runs.iter().map(|run| run.errors.len()).max().unwrap_or(0);
    let missing: usize = runs.iter().filter(|run| run.errors.is_empty()).map(|_| longest).sum();
    let share = |run: &Run| run.errors.iter().filter(is_good).count() as f64 / run.errors.len().max(1) as f64;
    let worst_drive = runs.iter().min_by(|a, b| share(a).total_cmp(&share(b)));
    let largest = |run: &Run| run.errors.iter().map(|error| error.0).fold(0.0, f64::max);
    let worst = runs.iter().max_by(|a, b| largest(a).total_cmp(&largest(b)));
    let marks = |values: Vec<f64>| [0.5, 0.95, 1.0].map(|mark| quantile(&values, mark));
    let sorted = |value: fn(&(f64, f64)) -> f64| {
        let mut values: Vec<f64> = errors.iter().map(value).collect();
        values.sort_by(f64::total_cmp);
        values
    };
    let starts = || runs.iter().filter_map(|run| run.start);
    CloudDrives {
        site,
        sensor,
        drives: runs.len(),
        recognised: starts().filter(|error| *error < 1.0).count(),
        wrong_starts: starts().filter(|error| *error >= 1.0).count(),
        start_worst_m: starts().fold(0.0, f64::max),
        good_share: errors.iter().filter(is_good).count() as f64 / (errors.len() + missing).max(1) as f64,
        worst_drive_share: worst_drive.map_or(0.0, share),
        worst_drive_seed: worst_drive.map_or(0, |run| run.seed),
        position_mm: marks(sorted(|error| 1e3 * error.0)),
        heading_deg: marks(sorted(|error| error.1.to_degrees())),
        worst_seed: worst.map_or(0, |run| run.seed),
        poses: errors.len() + missing,
    }
}

/// Everything that is seen from one vehicle.
struct Vehicle {
    lidar: SpinningLidar,
    projection: Projection,
    span: Span,
    order: RingOrder,
}

impl Vehicle {
    fn new(sensor: SensorKind) -> Self {
        let lidar = match sensor {
            SensorKind::Vlp16 => SpinningLidar::vlp16(),
            SensorKind::Hdl64e => SpinningLidar::hdl64e(),
        };
        let projection = Projection {
            levelling: Rotation3::identity(),
            height: lidar.height,
            bright: None,
            frame: SensorFrame::default(),
        };
        let lasers = lidar.lasers();
        let span = match sensor {
            SensorKind::Vlp16 => Span::VLP16,
            SensorKind::Hdl64e => Span::HDL64E,
        };
        Self { order: RingOrder::new(&lasers), lidar, projection, span }
    }

    fn cloud(&self, revolution: &Revolution) -> Vec<Option<[f32; 3]>> {
        revolution.organised(&self.order, self.lidar.columns as usize)
    }

    /// What the lidar sees of a drive, as the scans of a planar laser; `see` is given every cloud with its time.
    fn scans(&self, drive: &Recording, storeys: &Storeys, seed: u64, mut see: impl FnMut(&Revolution)) -> Recording {
        let mut random = Random::new(seed, Stream::MultiBeam);
        let mut speed = CloudSpeed::new(self.projection.levelling, self.lidar.height);
        let mut arrivals: Vec<(Time, RecordedEvent)> = Vec::new();
        for number in 0.. {
            let start = START.offset(f64::from(number) / self.lidar.frequency);
            let Some(revolution) = self.lidar.revolution(storeys, &drive.truth, start, &mut random) else { break };
            see(&revolution);
            let seen = self.projection.project(&revolution, speed.speed(&revolution));
            arrivals.push((start.offset(1.0 / self.lidar.frequency), RecordedEvent::Scan(seen.scan)));
        }
        let told = drive.events.iter().filter_map(|event| Some((event.time()?, event.clone())));
        arrivals.extend(told);
        arrivals.sort_by_key(|(time, _)| *time);
        let mut recording = Recording { landmarks: Vec::new(), ..drive.clone() };
        recording.events = arrivals.into_iter().map(|(_, event)| event).collect();
        recording
    }
}

fn scenario(site: Site, is_mapping: bool, vehicle: &Vehicle, seed: u64) -> Scenario {
    let mount = vehicle.lidar.mount;
    let mut scenario = Scenario { seed, ..Scenario::default() };
    if is_mapping {
        scenario.seed ^= MAPPING_SEED_BIT;
    }
    scenario.world = match site {
        Site::Hall => WorldOptions::WarehouseHall(WarehouseHall {
            seed: Some(seed),
            reflectors: false,
            ..WarehouseHall::default()
        }),
        Site::BlockStorage => WorldOptions::BlockStorage(BlockStorage { seed: Some(seed), ..BlockStorage::default() }),
    };
    scenario.path.kind = match (site, is_mapping) {
        (Site::Hall, _) => PathKind::HallLoop,
        (Site::BlockStorage, false) => PathKind::P1,
        (Site::BlockStorage, true) => PathKind::Mapping,
    };
    if site == Site::Hall {
        scenario.drive.speed = 1.2;
    }
    scenario.laser.scans = false;
    scenario.laser.mounting = PoseOptions { x: mount.x, y: mount.y, heading_deg: mount.theta.to_degrees() };
    scenario.start.given = false;
    scenario
}

fn map(vehicle: &Vehicle, site: Site, seed: u64) -> Result<(ContourMap, PlaceMap), CloudDriveError> {
    let scenario = scenario(site, true, vehicle, seed);
    let drive = simulate(&scenario)?.recording;
    let storeys = Storeys::of(&scenario);
    let standing = Standing::Given(vehicle.lidar.height as f32);
    let mut places: Vec<StoredPlace> = Vec::new();
    let mut scan = 0;
    let recording = vehicle.scans(&drive, &storeys, scenario.seed, |revolution| {
        scan += 1;
        let Some(pose) = truth_at(&drive.truth, revolution.start) else { return };
        let pose = pose.compose(&vehicle.lidar.mount);
        let is_near = |[x, y, _]: [f64; 3]| libm::hypot(pose.x - x, pose.y - y) < SHIFT;
        if places.last().and_then(|place| place.pose).is_some_and(is_near) {
            return;
        }
        let points = vehicle.cloud(revolution);
        let Some(cloud) = Cloud::new(&points, vehicle.order.rings()) else { return };
        places.push(StoredPlace {
            scan,
            pose: Some([pose.x, pose.y, pose.theta]),
            signatures: Signatures::new(&cloud, standing.height()),
            view: View::new(&cloud, &standing.floor(&cloud), vehicle.span),
        });
    });
    let mut places = PlaceMap { standing, rings: vehicle.order.rings(), span: vehicle.span, limit: None, places };
    places.limit = PlaceSearch::new(&places).map(|search| search.learnt_limit(|_| ()));
    Ok((map_contours_at(&recording, &drive.truth, CELL), places))
}

fn run(site: Site, sensor: SensorKind, seconds: Option<f64>, seed: u64) -> Result<Run, CloudDriveError> {
    let vehicle = Vehicle::new(sensor);
    let (contours, places) = map(&vehicle, site, seed)?;
    let scenario = scenario(site, false, &vehicle, seed);
    let mut drive = simulate(&scenario)?.recording;
    if let Some(seconds) = seconds {
        let end = START.offset(seconds);
        drive.truth.retain(|truth| truth.time <= end);
        drive.events.retain(|event| event.time().is_none_or(|time| time <= end));
    }
    let storeys = Storeys::of(&scenario);
    let mut first = None;
    let mut recording = vehicle.scans(&drive, &storeys, seed, |revolution| {
        if first.is_none() {
            let points = vehicle.cloud(revolution);
            let search = PlaceSearch::new(&places);
            let found =
                search.zip(Cloud::new(&points, vehicle.order.rings())).and_then(|(search, cloud)| search.find(&cloud));
            first = Some(found.filter(|found| found.is_believed && !found.is_ambiguous));
        }
    });
    let mut run = Run { seed, start: None, errors: Vec::new() };
    let (Some(Some(found)), Some(truth)) = (first, drive.truth.first()) else { return Ok(run) };
    let [x, y, heading] = found.pose;
    let pose = Pose::new(x, y, heading).compose(&vehicle.lidar.mount.inverse());
    run.start = Some((pose.position() - truth.pose.position()).norm());
    let fix = PoseFix { time: START, pose, position_deviation: FIRST.0, heading_deviation: FIRST.1 };
    recording.events.insert(0, RecordedEvent::SetPose(fix));
    let length = drive.truth.last().map_or(0.0, |last| last.time.since(START));
    let options = RigOptions::told(length, seed, Some(contours.view()));
    rig::drive(&recording, &[], &options, |heard| {
        if heard.time < SETTLED {
            return;
        }
        let error = heard.output.and_then(|output| {
            let truth = (heard.truth)(output.time)?;
            Some(((output.pose.position() - truth.position()).norm(), difference(output.pose.theta, truth.theta).abs()))
        });
        // A controller that says nothing is not good.
        run.errors.push(error.unwrap_or((f64::INFINITY, f64::INFINITY)));
    })?;
    Ok(run)
}
