//! A vehicle that drives by a kept map of contours alone, in worlds that have changed since they were mapped.
//!
//! It is told where it starts. Defined before the runs:
//!
//! - poses are those that it says a hundred times a second, from one second on;
//! - a pose is determined if the surfaces that did not move tell it to 3 mm and 0.03 deg by the information matrix of their true
//!   distances, at the first beam of the revolution;
//! - a pose is good within 10 mm and 0.1 deg of the truth;
//! - the vehicle says that a pose may not be good where twice a standard deviation of its covariance is beyond these.

use std::f64::consts::PI;

use agv_core::geometry::{Pose, difference};
use agv_core::localizer::{Parameters, PoseFix, PoseOutput};
use agv_core::measurement::{PoseIncrement, Time};
use agv_core::odometry::Vehicle;
use agv_host_sim::accuracy::Spread;
use agv_host_sim::recording::{RecordedEvent, Recording};
use agv_host_sim::replay::{ReplayError, replay_in};
use agv_host_sim::simulate::random::{Random, Stream};
use agv_host_sim::simulate::raycast::RayCaster;
use agv_host_sim::simulate::scenario::OdometryOptions;
use nalgebra::Matrix2;
use rayon::prelude::*;
use serde::Serialize;

use super::information::deviations;
use super::sites::{Site, SiteKind};
use super::survey::{BEAMS, map, revolution};
use super::ways::way;

/// The laser in R.
const LASER: Pose = Pose { x: 0.4, y: 0.0, theta: 0.0 };

/// Time between two samples of the odometry, s, and samples in a revolution.
const INTERVAL: f64 = 0.01;
const SAMPLES: usize = 12;
const BEAM_INTERVAL: f64 = SAMPLES as f64 * INTERVAL / BEAMS as f64;

/// Samples before poses count.
const SETTLED: usize = 100;

/// A pose is determined to these, m and rad,
const DETERMINED: (f64, f64) = (0.003, 0.03 * PI / 180.0);

/// and good within these.
const GOOD: (f64, f64) = (0.010, 0.1 * PI / 180.0);

/// Standard deviations that are told of the first pose, m and rad.
const FIRST: (f64, f64) = (0.02, 0.003);

/// The poses of one kind.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PoseAccuracy {
    /// Number.
    pub poses: usize,
    /// Share that is good.
    pub good_share: f64,
    /// Share of which the vehicle says that they may not be good.
    pub said_share: f64,
    /// Share that is further off than its protection level.
    pub mi_share: f64,
    /// Distance from the truth, mm.
    pub position_mm: Spread,
    /// Difference from the true heading, deg.
    pub heading_deg: Spread,
    /// Seed of the world with the largest distance.
    pub worst_seed: u64,
}

/// What became of the drives in worlds of one kind.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SiteDrives {
    /// Kind of the worlds.
    pub world: &'static str,
    /// Share of what may be moved that was moved since the map was made, by 5 to 50 cm; trucks have come and gone then.
    pub moved_share: f64,
    /// Drives.
    pub drives: usize,
    /// Share of the poses that are determined.
    pub determined_share: f64,
    /// Those.
    pub determined: PoseAccuracy,
    /// The others.
    pub others: PoseAccuracy,
}

/// One pose.
#[derive(Clone, Copy, Debug)]
struct Driven {
    seed: u64,
    is_determined: bool,
    is_said: bool,
    is_misleading: bool,
    position: f64,
    heading: f64,
}

impl Driven {
    fn new(seed: u64, is_determined: bool, said: &PoseOutput, truth: &Pose) -> Self {
        let position = (said.pose.position() - truth.position()).norm();
        let heading = difference(said.pose.theta, truth.theta).abs();
        let [xx, xy, yy, _, _, of_heading] = said.covariance;
        let of_position = Matrix2::new(xx, xy, xy, yy).symmetric_eigenvalues().max();
        Self {
            seed,
            is_determined,
            is_said: 2.0 * of_position.sqrt() > GOOD.0 || 2.0 * of_heading.sqrt() > GOOD.1,
            is_misleading: position > said.level.position || heading > said.level.heading,
            position,
            heading,
        }
    }

    fn is_good(&self) -> bool {
        self.position <= GOOD.0 && self.heading <= GOOD.1
    }
}

/// Drives for so many seconds in each of `drives` worlds of a kind, of which that share has been moved since they were mapped, from a seed
/// on; `done` is called after each.
///
/// # Errors
/// If a drive cannot be replayed.
pub fn drive_in_worlds(
    kind: SiteKind,
    moved_share: f64,
    seconds: f64,
    (seed, drives): (u64, u64),
    done: impl Fn() + Sync,
) -> Result<SiteDrives, ReplayError> {
    let all: Vec<Vec<Driven>> = (seed..seed + drives)
        .into_par_iter()
        .map(|seed| {
            let poses = drive(kind, moved_share, seconds, seed);
            done();
            poses
        })
        .collect::<Result<_, _>>()?;
    let (determined, others): (Vec<Driven>, Vec<Driven>) =
        all.into_iter().flatten().partition(|pose| pose.is_determined);
    Ok(SiteDrives {
        world: kind.name(),
        moved_share,
        drives: drives as usize,
        determined_share: determined.len() as f64 / (determined.len() + others.len()).max(1) as f64,
        determined: accuracy(&determined),
        others: accuracy(&others),
    })
}

fn accuracy(poses: &[Driven]) -> PoseAccuracy {
    let share =
        |is: fn(&Driven) -> bool| poses.iter().filter(|pose| is(pose)).count() as f64 / poses.len().max(1) as f64;
    let worst = poses.iter().max_by(|one, other| one.position.total_cmp(&other.position));
    PoseAccuracy {
        poses: poses.len(),
        good_share: share(Driven::is_good),
        said_share: share(|pose| pose.is_said),
        mi_share: share(|pose| pose.is_misleading),
        position_mm: Spread::of(poses.iter().map(|pose| 1e3 * pose.position)),
        heading_deg: Spread::of(poses.iter().map(|pose| pose.heading.to_degrees())),
        worst_seed: worst.map_or(0, |worst| worst.seed),
    }
}

fn time(sample: usize) -> Time {
    Time::from_seconds(1.0).offset(sample as f64 * INTERVAL)
}

fn drive(kind: SiteKind, moved_share: f64, seconds: f64, seed: u64) -> Result<Vec<Driven>, ReplayError> {
    let site = Site::new(kind, seed);
    let kept = map(&site, &mut Random::new(seed, Stream::Survey));
    let now = site.changed(moved_share, seed);
    let truth = way(&now, seconds, INTERVAL, &mut Random::new(seed, Stream::Start));
    let caster = RayCaster::new(&now.world());
    let recording = recording(&truth, &caster, seed);
    let replay = replay_in(&recording, Some(kept.view()), |_| {})?;
    let unmoved = RayCaster::new(&site.in_common(&now).world());
    let is_determined: Vec<bool> = truth
        .iter()
        .step_by(SAMPLES)
        .map(|pose| {
            let (position, heading) = deviations(&caster, &unmoved, &pose.compose(&LASER));
            position <= DETERMINED.0 && heading <= DETERMINED.1
        })
        .collect();
    let is_increment = |(event, _): &(&RecordedEvent, &PoseOutput)| matches!(event, RecordedEvent::Increment(_));
    let said = recording.events.iter().zip(&replay.poses).filter(is_increment).map(|(_, said)| said);
    let all = said.zip(&truth).enumerate().skip(SETTLED);
    Ok(all.map(|(sample, (said, truth))| Driven::new(seed, is_determined[sample / SAMPLES], said, truth)).collect())
}

/// What odometry and laser tell of a way.
fn recording(truth: &[Pose], caster: &RayCaster, seed: u64) -> Recording {
    let parameters = Parameters::new(Vehicle::Increments, LASER);
    let (mut laser, mut odometry) = (Random::new(seed, Stream::Laser), Random::new(seed, Stream::Odometry));
    let noise = OdometryOptions::default();
    let yaw_walk = noise.yaw_walk_deg.to_radians();
    let mut events = Vec::new();
    if let Some(pose) = truth.first() {
        let fix = PoseFix { time: time(0), pose: *pose, position_deviation: FIRST.0, heading_deviation: FIRST.1 };
        events.push(RecordedEvent::SetPose(fix));
    }
    let mut before = truth.first().copied().unwrap_or_default();
    for (sample, pose) in truth.iter().enumerate() {
        let moved = before.between(pose);
        before = *pose;
        let root = moved.x.abs().sqrt();
        let mut error = |deviation: f64| deviation * root * odometry.normal();
        let displacement =
            Pose::new(moved.x + error(noise.slip), moved.y + error(noise.side_slip), moved.theta + error(yaw_walk));
        events.push(RecordedEvent::Increment(PoseIncrement { time: time(sample), displacement }));
        // A scan comes when its last beam has been sent.
        if sample > 0 && sample % SAMPLES == 0 {
            let first = sample - SAMPLES;
            let laser_at = |beam: usize| {
                let place = beam as f64 * BEAM_INTERVAL / INTERVAL;
                let (from, share) = (first + place as usize, place.fract());
                let step = truth[from].between(&truth[(from + 1).min(sample)]).fraction(share);
                truth[from].compose(&step).compose(&LASER)
            };
            events.push(RecordedEvent::Scan(revolution(caster, laser_at, (time(first), BEAM_INTERVAL), &mut laser)));
        }
    }
    Recording { parameters, landmarks: Vec::new(), events, truth: Vec::new(), references: Vec::new(), state: None }
}
