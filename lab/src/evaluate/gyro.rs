//! How much heading a vehicle loses without landmarks, with a gyro and without, and how soon a slipping wheel is told.
//!
//! The whole controller drives in simulated time, with emulated encoders, gyro and laser. For the time before it sees reflectors;
//! then its laser is silent. Defined before the runs:
//!
//! - lost heading: the change of the published heading's error from the last pose before the laser falls silent to the pose after
//!   12 m of way, which is what a perfect start at that place would leave;
//! - the 95 % mark: the smallest value that 95 % of all drives do not exceed; no drive is left out;
//! - false alarm: a slip, or a fault of the gyro, that is told of a vehicle in order; those less than 10 s apart are one;
//! - told: the first pose on the bus with the reason [`Reason::WheelsSlip`] after the slip began; its way is that of the truth.

use std::ops::Range;

use agv_core::geometry::{Pose, difference};
use agv_core::state::Reason;
use agv_host_sim::simulate::path::{Direction, Leg, PathSegment};
use agv_host_sim::simulate::scenario::{
    PathKind, PathOptions, PoseOptions, ReflectorShape, Scenario, Shapes, Slip, WorldOptions,
};
use agv_host_sim::simulate::{SimulateError, simulate};
use rayon::prelude::*;
use serde::Serialize;

use crate::campaign::fault::{Fault, FaultKind};
use crate::campaign::rig::{self, RigError, RigOptions};
use crate::equipment::{Equipment, VehicleKind};

/// Way without landmarks, m.
const WAY: f64 = 12.0;
/// Time before, s.
const BEFORE: f64 = 60.0;
/// A gyro that was not heard before the drive is not missed for so long any more, s.
const SETTLED: f64 = 2.0;
/// Alarms less than this apart, s, are one.
const SAME_ALARM: f64 = 10.0;
/// Share of a wheel's way that slips.
const SLIP: f64 = 0.2;

/// Why it cannot be measured.
#[derive(Debug, thiserror::Error)]
pub enum GyroError {
    /// The scenario makes no sense.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// The controller cannot be driven.
    #[error(transparent)]
    Rig(#[from] RigError),
}

/// What the vehicle does in the time before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Before {
    /// It stands.
    Stands,
    /// It drives curves to the left and to the right.
    Drives,
}

/// The way without landmarks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Way {
    /// A line.
    Straight,
    /// A line, a quarter of a turn, and a line.
    Curve,
}

/// What can show a slip, beside redundant wheels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ShownBy {
    /// A gyro; the laser is silent.
    Gyro,
    /// The reflectors around; there is no gyro.
    Reflectors,
    /// Nothing: the laser is silent, and there is no gyro.
    Nothing,
}

/// What was measured of one kind of drive.
#[derive(Clone, Debug, Serialize)]
pub struct HeadingRow {
    /// The vehicle.
    pub vehicle: VehicleKind,
    /// What it did before.
    pub before: Before,
    /// The way.
    pub way: Way,
    /// Whether there was a gyro.
    pub has_gyro: bool,
    /// Drives.
    pub drives: usize,
    /// Median of the lost heading, deg.
    pub median_deg: f64,
    /// The 95 % mark, deg.
    pub mark_95_deg: f64,
    /// The largest, deg, and its seed.
    pub worst_deg: f64,
    /// Seed of the worst drive.
    pub worst_seed: u64,
    /// Drives in which the error of the heading was larger than its protection level at any pose on the way.
    pub beyond_level: usize,
    /// Drives in which a slip or a fault of the gyro was told, though there was none.
    pub false_alarms: usize,
}

/// What was measured of slips.
#[derive(Clone, Debug, Serialize)]
pub struct SlipRow {
    /// The vehicle, whose first wheel slips.
    pub vehicle: VehicleKind,
    /// Where the wheel slips.
    pub way: Way,
    /// What can show it beside the wheels.
    pub shown_by: ShownBy,
    /// Drives.
    pub drives: usize,
    /// Those in which the slip was told.
    pub told: usize,
    /// The longest way until it was told, m.
    pub longest_m: f64,
    /// Seed of that drive.
    pub worst_seed: u64,
    /// Drives in which the position or heading was beyond its protection level at any pose of the slip and the metre behind.
    pub beyond_level: usize,
}

/// What was told of vehicles in order.
#[derive(Clone, Debug, Serialize)]
pub struct SoundRow {
    /// The vehicle.
    pub vehicle: VehicleKind,
    /// Whether there was a gyro.
    pub has_gyro: bool,
    /// Drives.
    pub drives: usize,
    /// Way of all, km.
    pub km: f64,
    /// False alarms.
    pub false_alarms: usize,
    /// Seeds of the drives with any.
    pub seeds: Vec<u64>,
}

/// All that was measured.
#[derive(Clone, Debug, Serialize)]
pub struct GyroOutcome {
    /// Headings.
    pub headings: Vec<HeadingRow>,
    /// Slips.
    pub slips: Vec<SlipRow>,
    /// Vehicles in order.
    pub sound: Vec<SoundRow>,
}

/// One drive without landmarks.
struct Drive {
    lost: f64,
    is_beyond: bool,
    is_alarmed: bool,
}

/// What is to be measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GyroOptions {
    /// Drives of each kind.
    pub drives: u32,
    /// Seed of the first.
    pub seed: u64,
    /// Whether lost headings are measured.
    pub headings: bool,
    /// Whether slips are measured.
    pub slips: bool,
    /// Whether false alarms are counted.
    pub sound: bool,
    /// With this vehicle alone.
    pub only: Option<VehicleKind>,
    /// True error of the gyro's scale where headings are measured, share; none for the simulator's.
    pub scale_error: Option<f64>,
}

impl GyroOptions {
    fn vehicles(&self) -> impl Iterator<Item = VehicleKind> {
        let only = self.only;
        let given = only.filter(|only| !VEHICLES.contains(only));
        VEHICLES.into_iter().filter(move |vehicle| only.is_none_or(|only| only == *vehicle)).chain(given)
    }

    fn kinds(&self) -> impl Iterator<Item = Kind> {
        let scale_error = self.scale_error;
        let of = move |vehicle| {
            kinds().map(move |(before, way, has_gyro)| Kind { vehicle, before, way, has_gyro, scale_error })
        };
        self.vehicles().filter(|_| self.headings).flat_map(of)
    }

    fn slips(&self) -> impl Iterator<Item = (VehicleKind, Way, ShownBy)> {
        let of = |vehicle| slips_of().map(move |(way, shown_by)| (vehicle, way, shown_by));
        self.vehicles().filter(|_| self.slips).flat_map(of)
    }

    fn sound(&self) -> impl Iterator<Item = (VehicleKind, bool)> {
        self.vehicles().filter(|_| self.sound).flat_map(|vehicle| [true, false].map(|has_gyro| (vehicle, has_gyro)))
    }

    /// How many drives [`run`] makes.
    #[must_use]
    pub fn count(&self) -> u64 {
        (self.kinds().count() + self.slips().count() + self.sound().count()) as u64 * u64::from(self.drives)
    }
}

/// Drives each kind. `step` is called after each drive.
///
/// # Errors
/// See [`GyroError`].
pub fn run(options: &GyroOptions, step: impl Fn() + Sync) -> Result<GyroOutcome, GyroError> {
    let seeds = options.seed..options.seed + u64::from(options.drives);
    let (mut headings, mut slips) = (Vec::new(), Vec::new());
    for kind in options.kinds() {
        let found = over(seeds.clone(), &step, |seed| blind_drive(kind, seed))?;
        headings.push(heading_row(kind, &found));
    }
    for (vehicle, way, shown_by) in options.slips() {
        slips.push(slip_row(vehicle, way, shown_by, seeds.clone(), &step)?);
    }
    let mut sound = Vec::new();
    for (vehicle, has_gyro) in options.sound() {
        let found = over(seeds.clone(), &step, |seed| sound_drive(vehicle, has_gyro, seed))?;
        sound.push(SoundRow {
            vehicle,
            has_gyro,
            drives: found.len(),
            km: 1e-3 * found.iter().map(|(_, (way, _))| way).sum::<f64>(),
            false_alarms: found.iter().map(|(_, (_, alarms))| alarms).sum(),
            seeds: found.iter().filter(|(_, (_, alarms))| *alarms > 0).map(|(seed, _)| *seed).collect(),
        });
    }
    Ok(GyroOutcome { headings, slips, sound })
}

/// What `drive` gives for each seed, in their order.
fn over<T: Send>(
    seeds: Range<u64>,
    step: &(impl Fn() + Sync),
    drive: impl Fn(u64) -> Result<T, GyroError> + Sync,
) -> Result<Vec<(u64, T)>, GyroError> {
    let drive = |seed| {
        let found = drive(seed)?;
        step();
        Ok((seed, found))
    };
    seeds.into_par_iter().map(drive).collect()
}

/// Lets a wheel of a vehicle slip on drives with those seeds. `step` is called after each drive.
///
/// # Errors
/// See [`GyroError`].
pub fn slip_row(
    vehicle: VehicleKind,
    way: Way,
    shown_by: ShownBy,
    seeds: Range<u64>,
    step: impl Fn() + Sync,
) -> Result<SlipRow, GyroError> {
    let first = seeds.start;
    let found = over(seeds, &step, |seed| slipping_drive(vehicle, way, shown_by, seed))?;
    let ways = found.iter().filter_map(|(seed, (after, _))| Some((*seed, (*after)?)));
    let (worst_seed, longest_m) =
        ways.clone().fold((first, 0.0), |worst, way| if way.1 > worst.1 { way } else { worst });
    Ok(SlipRow {
        vehicle,
        way,
        shown_by,
        drives: found.len(),
        told: ways.count(),
        longest_m,
        worst_seed,
        beyond_level: found.iter().filter(|(_, (_, is_beyond))| *is_beyond).count(),
    })
}

const VEHICLES: [VehicleKind; 4] =
    [VehicleKind::Tricycle, VehicleKind::Differential, VehicleKind::BiSteerable, VehicleKind::Omni4];
const WAYS: [Way; 2] = [Way::Straight, Way::Curve];

/// One kind of drive.
#[derive(Clone, Copy)]
struct Kind {
    vehicle: VehicleKind,
    before: Before,
    way: Way,
    has_gyro: bool,
    scale_error: Option<f64>,
}

fn kinds() -> impl Iterator<Item = (Before, Way, bool)> {
    [Before::Stands, Before::Drives]
        .into_iter()
        .flat_map(|before| WAYS.into_iter().flat_map(move |way| [true, false].map(|has_gyro| (before, way, has_gyro))))
}

fn slips_of() -> impl Iterator<Item = (Way, ShownBy)> {
    let shown = [ShownBy::Gyro, ShownBy::Reflectors, ShownBy::Nothing];
    WAYS.into_iter().flat_map(move |way| shown.map(|shown_by| (way, shown_by)))
}

fn heading_row(kind: Kind, found: &[(u64, Drive)]) -> HeadingRow {
    let Kind { vehicle, before, way, has_gyro, .. } = kind;
    let mut lost: Vec<f64> = found.iter().map(|(_, drive)| drive.lost.to_degrees()).collect();
    lost.sort_by(f64::total_cmp);
    // No drive is as good as one that was not made.
    let at = |share: f64| {
        let place = (share * lost.len() as f64).ceil() as usize;
        lost.get(place.saturating_sub(1)).copied().unwrap_or(f64::NAN)
    };
    let worst = found.iter().max_by(|one, other| one.1.lost.total_cmp(&other.1.lost));
    HeadingRow {
        vehicle,
        before,
        way,
        has_gyro,
        drives: found.len(),
        median_deg: at(0.5),
        mark_95_deg: at(0.95),
        worst_deg: at(1.0),
        worst_seed: worst.map_or(0, |(seed, _)| *seed),
        beyond_level: found.iter().filter(|(_, drive)| drive.is_beyond).count(),
        false_alarms: found.iter().filter(|(_, drive)| drive.is_alarmed).count(),
    }
}

fn segment(length: f64, curvature: f64) -> PathSegment {
    PathSegment { length, curvature }
}

/// A hall with reflectors at its walls, and the way through it.
fn scenario(kind: Kind, seed: u64) -> Scenario {
    let Kind { vehicle, before, way, has_gyro, scale_error } = kind;
    let mut scenario = Scenario { seed, ..Scenario::default() };
    let place = |number: u32| {
        // No two of them are as far apart as two others.
        let along = f64::from(number) * 3.1 + f64::from(number * number % 7) * 0.23;
        let (length, width) = (30.0, 22.0);
        match along % 104.0 {
            way if way < length => (way, 0.0),
            way if way < length + width => (length, way - length),
            way if way < 2.0 * length + width => (2.0 * length + width - way, width),
            way => (0.0, 2.0 * (length + width) - way),
        }
    };
    let reflectors = (0..33)
        .map(|number| {
            let (x, y) = place(number);
            ReflectorShape::seen_all_round(x - 6.0, y - 11.0)
        })
        .collect();
    scenario.world = WorldOptions::Shapes(Shapes { reflectors, ..Shapes::default() });
    scenario.laser.scans = false;
    scenario.drive.start_standstill = 1.0;
    let mut segments = Vec::new();
    match before {
        Before::Stands => scenario.drive.start_standstill = BEFORE,
        Before::Drives => {
            // Circles to either side, 47 m in the 60 s before.
            let circle = std::f64::consts::TAU * 1.9;
            for side in [1.0, -1.0, 1.0, -1.0] {
                segments.push(segment(circle, side / 1.9));
            }
        }
    }
    match way {
        Way::Straight => segments.push(segment(16.0, 0.0)),
        Way::Curve => {
            let radius = 2.5;
            let quarter = std::f64::consts::FRAC_PI_2 * radius;
            segments.extend([segment(6.0, 0.0), segment(quarter, 1.0 / radius), segment(6.0, 0.0)]);
        }
    }
    scenario.path = PathOptions {
        kind: PathKind::Legs,
        start: PoseOptions { x: 0.0, y: -1.0, heading_deg: 0.0 },
        legs: vec![Leg { direction: Direction::Forward, segments }],
    };
    Equipment { vehicle, gyro: has_gyro, gyro_scale_error: scale_error, ..Equipment::default() }.apply(&mut scenario);
    scenario
}

/// When the last metres begin of which the vehicle sees nothing, s after the first event, and how long the drive lasts.
fn times(scenario: &Scenario, before: Before) -> (f64, f64) {
    let speed = scenario.drive.speed;
    let length: f64 = scenario.path.legs.iter().flat_map(|leg| &leg.segments).map(|segment| segment.length).sum();
    let driven = length - if before == Before::Stands { length } else { 16.0 };
    let lead = 0.5 * speed / scenario.drive.acceleration;
    let blind = scenario.drive.start_standstill + driven / speed + lead + 1.0;
    let end = scenario.drive.start_standstill + length / speed + 2.0 * lead;
    (blind, end)
}

/// The laser's network is gone from then on, s.
fn silence_from(from: f64) -> Fault {
    Fault { name: "no laser".to_owned(), from, until: None, what: FaultKind::LaserUnreachable, can_recover: false }
}

fn heading_error(found: &Pose, truth: &Pose) -> f64 {
    difference(found.theta, truth.theta)
}

fn blind_drive(kind: Kind, seed: u64) -> Result<Drive, GyroError> {
    let scenario = scenario(kind, seed);
    let (blind, end) = times(&scenario, kind.before);
    let simulation = simulate(&scenario)?;
    let silence = silence_from(blind);
    let options = RigOptions::told(end, seed, None);
    let (mut at_start, mut way_driven, mut last): (Option<f64>, f64, Option<Pose>) = (None, 0.0, None);
    let mut drive = Drive { lost: f64::INFINITY, is_beyond: false, is_alarmed: false };
    rig::drive(&simulation.recording, &[&silence], &options, |heard| {
        let Some(output) = heard.output else { return };
        let Some(truth) = (heard.truth)(output.time) else { return };
        let error = heading_error(&output.pose, &truth);
        drive.is_alarmed |= heard.time > SETTLED && matches!(output.reason, Reason::WheelsSlip | Reason::GyroFault);
        if heard.time < blind || way_driven > WAY {
            return;
        }
        let begun = *at_start.get_or_insert(error);
        way_driven += last.replace(truth).map_or(0.0, |last| last.between(&truth).position().norm());
        drive.is_beyond |= error.abs() > output.level.heading;
        if way_driven >= WAY {
            drive.lost = (error - begun).abs();
        }
    })?;
    Ok(drive)
}

/// Way of a vehicle in order among reflectors, m, and how often it was alarmed.
fn sound_drive(vehicle: VehicleKind, has_gyro: bool, seed: u64) -> Result<(f64, usize), GyroError> {
    let kind = Kind { vehicle, before: Before::Drives, way: Way::Curve, has_gyro, scale_error: None };
    let scenario = scenario(kind, seed);
    let (_, end) = times(&scenario, Before::Drives);
    let simulation = simulate(&scenario)?;
    let options = RigOptions::told(end, seed, None);
    let (mut way, mut last) = (0.0, None::<Pose>);
    let (mut alarms, mut last_alarm) = (0, f64::NEG_INFINITY);
    rig::drive(&simulation.recording, &[], &options, |heard| {
        let Some(output) = heard.output else { return };
        let Some(truth) = (heard.truth)(output.time) else { return };
        way += last.replace(truth).map_or(0.0, |last| last.between(&truth).position().norm());
        if heard.time > SETTLED && matches!(output.reason, Reason::WheelsSlip | Reason::GyroFault) {
            alarms += usize::from(heard.time - last_alarm > SAME_ALARM);
            last_alarm = heard.time;
        }
    })?;
    Ok((way, alarms))
}

/// The way until the slip was told, and whether the pose was beyond its protection level meanwhile.
fn slipping_drive(
    vehicle: VehicleKind,
    way: Way,
    shown_by: ShownBy,
    seed: u64,
) -> Result<(Option<f64>, bool), GyroError> {
    let has_gyro = shown_by == ShownBy::Gyro;
    let mut scenario = scenario(Kind { vehicle, before: Before::Stands, way, has_gyro, scale_error: None }, seed);
    // In the middle of the curve or of the line.
    let lead = 0.5 * scenario.drive.speed / scenario.drive.acceleration;
    let from = BEFORE + lead + 7.5 / scenario.drive.speed;
    scenario.odometry.slips = vec![Slip { from, lasts: 1.5, share: SLIP, wheel: 0 }];
    let (_, end) = times(&scenario, Before::Stands);
    let simulation = simulate(&scenario)?;
    let silence = silence_from(BEFORE + lead + 1.0);
    let faults = if shown_by == ShownBy::Reflectors { &[][..] } else { &[&silence] };
    let options = RigOptions::told(end.min(from + 3.0), seed, None);
    let (mut begun, mut told, mut is_beyond) = (None::<Pose>, None, false);
    let (mut driven, mut last) = (0.0, None::<Pose>);
    rig::drive(&simulation.recording, faults, &options, |heard| {
        let Some(output) = heard.output.filter(|_| heard.time >= from) else { return };
        let Some(truth) = (heard.truth)(output.time) else { return };
        begun.get_or_insert(truth);
        driven += last.replace(truth).map_or(0.0, |last| last.between(&truth).position().norm());
        let position = (output.pose.position() - truth.position()).norm();
        is_beyond |=
            heading_error(&output.pose, &truth).abs() > output.level.heading || position > output.level.position;
        if output.reason == Reason::WheelsSlip {
            told.get_or_insert(driven);
        }
    })?;
    Ok((told, is_beyond))
}
