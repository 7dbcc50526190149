//! What is wrong with a vehicle whose encoders and laser do not tell one motion: every mistake that hands make is undone in turn,
//! and those are named under which the drive makes sense.
//!
//! Some mistakes cannot be told apart by any drive: a drive counter that counts the wrong way does to the motion exactly what a
//! steering offset of 180 degrees does. Both are named then.

use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt;

use agv_core::calibration::Offsets;
use agv_core::geometry::wrap;
use agv_core::measurement::EncoderSample;
use agv_core::odometry::{CounterRange, Tricycle, Vehicle};

use super::counted::count;
use super::counting_direction::{POOR, unexplained};
use super::drive::{Drive, Preparation, is_followed, located_poses};
use super::found::{Found, Method, Question, find};
use super::log_input::LogInput;
use super::model::VehicleModel;
use super::odometry_path::OdometryPath;
use super::tracking::track;

/// One thing that is wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cause {
    /// The driving wheel's encoder counts the wrong way.
    DriveReversed,
    /// The steering's encoder counts the wrong way.
    SteeringReversed,
    /// Each encoder is taken for the other.
    EncodersSwapped,
    /// The steering offset is off by about so much, rad.
    SteeringOffset(f64),
    /// The wheelbase is so long, m.
    Wheelbase(f64),
    /// The laser looks in another direction: by so much, rad.
    LaserHeading(f64),
    /// The laser is elsewhere: by so much ahead and to the left, m.
    LaserPlace(f64, f64),
    /// So many reflectors are seen at once, which are too few.
    FewReflectors(usize),
}

impl fmt::Display for Cause {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::DriveReversed => write!(formatter, "the drive counter counts the wrong way"),
            Self::SteeringReversed => write!(formatter, "the steering counter counts the wrong way"),
            Self::EncodersSwapped => write!(formatter, "the two encoders are exchanged"),
            Self::SteeringOffset(offset) => {
                write!(formatter, "the steering offset is off by {:.0} deg", offset.to_degrees())
            }
            Self::Wheelbase(length) => write!(formatter, "the wheelbase is {length:.3} m"),
            Self::LaserHeading(turn) => write!(formatter, "the laser is turned by {:.1} deg", turn.to_degrees()),
            Self::LaserPlace(x, y) => {
                write!(
                    formatter,
                    "the laser is {:.0} mm further ahead and {:.0} mm further to the left",
                    1e3 * x,
                    1e3 * y
                )
            }
            Self::FewReflectors(0) => write!(formatter, "no reflectors are seen"),
            Self::FewReflectors(count) => {
                write!(formatter, "{count} reflectors are seen at once, where {FEWEST_REFLECTORS} are needed")
            }
        }
    }
}

impl Cause {
    /// What to do about it.
    #[must_use]
    pub fn remedy(&self) -> String {
        match self {
            Self::DriveReversed => {
                "change the sign of vehicle.drive_scale: agv calibrate LOG --mend --apply vehicle.toml".into()
            }
            Self::SteeringReversed => {
                "change the sign of vehicle.steering_scale: agv calibrate LOG --mend --apply vehicle.toml".into()
            }
            Self::EncodersSwapped => "exchange can.drive_node and can.steering_node, or the plugs".into(),
            Self::SteeringOffset(offset) => {
                format!("add {:.4} rad to vehicle.steering_offset_forward and vehicle.steering_offset_backward", offset)
            }
            Self::Wheelbase(_) => "measure it, or: agv calibrate LOG --wheelbase --apply vehicle.toml".into(),
            Self::LaserHeading(_) | Self::LaserPlace(..) => "agv calibrate LOG --apply vehicle.toml".into(),
            Self::FewReflectors(_) => "put up more reflectors, or look why they are not seen: agv view LOG".into(),
        }
    }
}

/// A set of mistakes under which the drive makes sense; empty if it makes sense as it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Explanation {
    /// The mistakes, together.
    pub causes: Vec<Cause>,
    /// Residual noise by the usual one; 1 is usual.
    pub noise: f64,
}

/// Reflectors that must be seen at once.
pub const FEWEST_REFLECTORS: usize = 3;
/// Explanations that leave more noise than the best by this factor are none.
const NOISIER: f64 = 2.0;
/// Differences of the laser's heading (rad) and place (m) and of the wheelbase (share) that are no adjustment any more.
const HEADING: f64 = 0.5 * PI / 180.0;
const PLACE: f64 = 0.05;
const WHEELBASE: f64 = 0.003;
/// In standard deviations.
const CLEAR: f64 = 4.0;

const QUESTION: Question = Question {
    method: Method::Joint,
    offsets: Offsets::ForEachSense,
    is_wheelbase_free: true,
    is_steering_ratio_free: false,
    side: None,
};

/// Mistakes with encoders, as they are undone: exchanged, steering reversed, quarter turns of the steering. Half a turn of the
/// steering is also what a reversed drive counter is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Undone {
    swapped: bool,
    reversed: bool,
    quarters: u8,
}

impl Undone {
    fn all() -> impl Iterator<Item = Self> {
        let flags = [false, true];
        flags.into_iter().flat_map(move |swapped| {
            flags.into_iter().flat_map(move |reversed| (0..4).map(move |quarters| Self { swapped, reversed, quarters }))
        })
    }

    /// The encoders as they would be without the mistakes.
    fn apply(self, input: &LogInput, tricycle: &Tricycle) -> LogInput {
        let range = tricycle.steering_range;
        let quarter = (f64::from(self.quarters) * FRAC_PI_2 / tricycle.steering_scale).round() as i64;
        let undo = |sample: &EncoderSample| {
            let mut right = *sample;
            if self.swapped {
                (right.drive, right.steering) = (right.steering, right.drive);
            }
            let turned = if self.reversed { -i64::from(right.steering) } else { i64::from(right.steering) };
            right.steering = within(turned + quarter, range);
            right
        };
        LogInput { encoders: input.encoders.iter().map(undo).collect(), ..input.clone() }
    }

    /// Sets of mistakes that do the same.
    fn sets(self) -> Vec<Vec<Cause>> {
        let mut common = Vec::new();
        common.extend(self.swapped.then_some(Cause::EncodersSwapped));
        common.extend(self.reversed.then_some(Cause::SteeringReversed));
        let alternatives: Vec<Option<Cause>> = match self.quarters {
            0 => vec![None],
            2 => vec![Some(Cause::DriveReversed), Some(Cause::SteeringOffset(PI))],
            quarters => vec![Some(Cause::SteeringOffset(wrap(f64::from(quarters) * FRAC_PI_2)))],
        };
        alternatives.into_iter().map(|last| common.iter().copied().chain(last).collect()).collect()
    }
}

fn within(count: i64, range: CounterRange) -> u32 {
    count.rem_euclid(range.values() as i64) as u32
}

/// Every explanation of a drive with the fewest mistakes. `progress` is called with the number of tries done, of [`TRIES`]. None
/// if nothing explains the drive.
#[must_use]
pub fn explain(input: &LogInput, mut progress: impl FnMut(usize)) -> Vec<Explanation> {
    let Vehicle::Tricycle(tricycle) = input.parameters.vehicle else { return Vec::new() };
    let seen = reflectors_at_once(input);
    if seen < FEWEST_REFLECTORS && input.laser_poses.len() < 2 && input.given_poses.len() < 2 {
        return vec![Explanation { causes: vec![Cause::FewReflectors(seen)], noise: f64::NAN }];
    }
    let mut tried = 0;
    let mut candidates = Vec::new();
    // Reflectors are followed by odometry, so a laser that is taken to look elsewhere must be tried with its turn.
    for turn in 0..4_u8 {
        let mut turned = input.clone();
        let mount = turned.parameters.lasers.first_mut();
        mount.theta = wrap(mount.theta + f64::from(turn) * FRAC_PI_2);
        let short = beginning(&turned);
        for undone in Undone::all() {
            tried += 1;
            progress(tried);
            if makes_sense(&undone.apply(&short, &tricycle), &tricycle) {
                candidates.extend(candidate(&turned, &tricycle, undone, input));
            }
        }
        // One mistake at the most: no other direction of the laser explains the drive with fewer.
        if candidates.iter().any(|candidate: &Explanation| candidate.causes.len() <= 1) {
            break;
        }
    }
    simplest(candidates)
}

/// The same log of a vehicle that is believed to count as one of the explanations says; None if none of them says that a counter
/// counts the wrong way, or all of them something that no sign mends.
#[must_use]
pub fn with_signs(input: &LogInput, explanations: &[Explanation]) -> Option<LogInput> {
    let is_sign = |cause: &Cause| matches!(cause, Cause::DriveReversed | Cause::SteeringReversed);
    let is_mendable = |cause: &Cause| !matches!(cause, Cause::EncodersSwapped | Cause::SteeringOffset(_));
    let chosen =
        explanations.iter().find(|found| found.causes.iter().any(is_sign) && found.causes.iter().all(is_mendable))?;
    let mut signed = input.clone();
    let Vehicle::Tricycle(tricycle) = &mut signed.parameters.vehicle else { return None };
    for cause in &chosen.causes {
        match cause {
            Cause::DriveReversed => tricycle.drive_scale = -tricycle.drive_scale,
            Cause::SteeringReversed => tricycle.steering_scale = -tricycle.steering_scale,
            _ => {}
        }
    }
    Some(signed)
}

/// Tries that [`explain`] tells.
pub const TRIES: usize = 64;

/// Reflectors of half of the revolutions.
fn reflectors_at_once(input: &LogInput) -> usize {
    let mut counts: Vec<usize> = input.revolutions.iter().map(Vec::len).collect();
    let middle = counts.len() / 2;
    if counts.is_empty() { 0 } else { *counts.select_nth_unstable(middle).1 }
}

/// Share of a drive by which mistakes that make no sense are told at once, and its least duration, s.
const BEGINNING: f64 = 0.2;
const SHORTEST_BEGINNING: f64 = 40.0;

/// The first part of a log.
fn beginning(input: &LogInput) -> LogInput {
    let times = || input.encoders.iter().map(|sample| sample.time);
    let (Some(first), Some(last)) = (times().min(), times().max()) else { return input.clone() };
    let end = first.offset((BEGINNING * last.since(first)).max(SHORTEST_BEGINNING));
    let mut short = input.clone();
    short.encoders.retain(|sample| sample.time <= end);
    short.revolutions.retain(|seen| seen.iter().all(|one| one.time <= end));
    short.laser_poses.retain(|pose| pose.time <= end);
    short.given_poses.retain(|pose| pose.time <= end);
    short
}

/// Whether the encoders explain most of what the laser has seen.
fn makes_sense(input: &LogInput, tricycle: &Tricycle) -> bool {
    let model = VehicleModel::nominal(tricycle, input.parameters.lasers.first());
    let (counted, _) = count(&input.encoders, tricycle, false);
    let tracked = track(&input.revolutions, &OdometryPath::new(&counted, &model));
    let located = located_poses(&tracked);
    let poses = if located.len() >= 2 {
        if !is_followed(&tracked) {
            return false;
        }
        located
    } else if input.laser_poses.len() >= 2 {
        input.laser_poses.clone()
    } else {
        input.given_poses.clone()
    };
    // What hardly moves in its beginning is looked at as a whole.
    unexplained(&counted, &model, &poses).is_none_or(|share| share < POOR)
}

/// What is wrong if these mistakes are undone and the drive then makes sense.
fn candidate(turned: &LogInput, tricycle: &Tricycle, undone: Undone, input: &LogInput) -> Vec<Explanation> {
    let right = undone.apply(turned, tricycle);
    let Ok(drive) = Drive::new(&right, &Preparation::default()) else { return Vec::new() };
    let Ok(found) = find(&drive, &QUESTION) else { return Vec::new() };
    let nominal = VehicleModel::nominal(tricycle, input.parameters.lasers.first());
    let measured = differences(&found, &nominal);
    let noise = level(&found);
    let sets = undone.sets().into_iter();
    sets.map(|set| Explanation { causes: set.into_iter().chain(measured.iter().copied()).collect(), noise }).collect()
}

/// How much noise is left, by the usual one.
fn level(found: &Found) -> f64 {
    let usual = super::noise::NoiseModel::default();
    (found.noise.slip / usual.slip).max(found.noise.steering / usual.steering)
}

/// Parameters that are not those of the log.
#[must_use]
pub fn differences(found: &Found, nominal: &VehicleModel) -> Vec<Cause> {
    let [.., wheelbase, _, x, y, heading] = found.deviations;
    let mut causes = Vec::new();
    let stretch = found.model.wheelbase - nominal.wheelbase;
    if stretch.abs() > (CLEAR * wheelbase).max(WHEELBASE * nominal.wheelbase) {
        causes.push(Cause::Wheelbase(found.model.wheelbase));
    }
    let turn = wrap(found.model.laser.theta - nominal.laser.theta);
    if turn.abs() > (CLEAR * heading).max(HEADING) {
        causes.push(Cause::LaserHeading(turn));
    }
    let (ahead, left) = (found.model.laser.x - nominal.laser.x, found.model.laser.y - nominal.laser.y);
    if ahead.abs() > (CLEAR * x).max(PLACE) || left.abs() > (CLEAR * y).max(PLACE) {
        causes.push(Cause::LaserPlace(ahead, left));
    }
    causes
}

/// Those that leave little noise, and of these the ones with the fewest mistakes.
fn simplest(mut candidates: Vec<Explanation>) -> Vec<Explanation> {
    let least = candidates.iter().map(|candidate| candidate.noise).fold(f64::INFINITY, f64::min);
    candidates.retain(|candidate| candidate.noise <= NOISIER * least.max(0.1));
    let fewest = candidates.iter().map(|candidate| candidate.causes.len()).min().unwrap_or_default();
    candidates.retain(|candidate| candidate.causes.len() == fewest);
    candidates.sort_by(|a, b| a.noise.total_cmp(&b.noise));
    candidates
}
