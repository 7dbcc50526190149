//! What is wrong with a vehicle whose encoders and laser do not tell one motion: every mistake that hands make is undone in turn,
//! and those are named under which the drive makes sense.
//!
//! What no drive tells apart by its motion:
//! - A drive counter that counts the wrong way moves the vehicle as a steering offset of 180 degrees does. A driving wheel looks
//!   ahead rather than back, so that is believed under which it does.
//! - Both at once undo each other: the drive makes sense as it is. A drive counter that counts the wrong way, with an offset of 90
//!   degrees, is an offset of -90 degrees.
//! - Two counters that count the wrong way are a laser that looks back from the other end of the vehicle. A place of the laser that
//!   has to be exactly there is a coincidence, so it is believed last.
//! - With fewer reflectors at once than [`FEWEST_REFLECTORS`] nothing else is told.

use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt;

use agv_core::calibration::Offsets;
use agv_core::geometry::{difference, wrap};
use agv_core::measurement::EncoderSample;
use agv_core::odometry::{CounterRange, Tricycle, Vehicle};

use super::counted::{Counted, count};
use super::counting_direction::{POOR, unexplained};
use super::drive::{Drive, is_followed, located_poses};
use super::found::{Found, Method, Question, find_any};
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
            Self::FewReflectors(1) => {
                write!(formatter, "1 reflector is seen at once, where {FEWEST_REFLECTORS} are needed")
            }
            Self::FewReflectors(count) => {
                write!(formatter, "{count} reflectors are seen at once, where {FEWEST_REFLECTORS} are needed")
            }
        }
    }
}

impl Cause {
    /// Mistakes that it stands for: a place is two measures, and both would have to be wrong.
    const fn weight(&self) -> usize {
        if matches!(self, Self::LaserPlace(..)) { 2 } else { 1 }
    }

    /// Whether a parameter of the vehicle mends it. Of an offset of half a turn none does: the readings jump where the wheel looks
    /// ahead, and the localiser takes the mean of two readings in a row.
    #[must_use]
    pub fn is_parameter(&self) -> bool {
        match self {
            Self::EncodersSwapped | Self::FewReflectors(_) => false,
            Self::SteeringOffset(offset) => offset.abs() < HALF_TURN,
            _ => true,
        }
    }

    /// Whether both say the same, as far as a drive tells it.
    fn is_like(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::SteeringOffset(first), Self::SteeringOffset(second)) => {
                difference(*first, *second).abs() < SAME_ANGLE
            }
            _ => std::mem::discriminant(self) == std::mem::discriminant(other),
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
    /// Whether the driving wheel then looks back rather than ahead for most of the way, as hardly any does.
    pub is_wheel_behind: bool,
}

impl fmt::Display for Explanation {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let causes: Vec<String> = self.causes.iter().map(ToString::to_string).collect();
        formatter.write_str(&causes.join(", and "))
    }
}

impl Explanation {
    fn weight(&self) -> usize {
        self.causes.iter().map(Cause::weight).sum::<usize>() + usize::from(self.is_wheel_behind)
    }

    fn is_like(&self, other: &Self) -> bool {
        let holds = |all: &[Cause], one: &Cause| all.iter().any(|cause| cause.is_like(one));
        self.causes.len() == other.causes.len() && self.causes.iter().all(|cause| holds(&other.causes, cause))
    }

    /// Whether parameters of the vehicle mend it.
    #[must_use]
    pub fn is_mendable(&self) -> bool {
        !self.causes.is_empty() && self.causes.iter().all(Cause::is_parameter)
    }

    /// What to do about it, with commands that name the log so.
    #[must_use]
    pub fn remedy(&self, log: &str) -> String {
        let has = |is: fn(&Cause) -> bool| self.causes.iter().any(is);
        if has(|cause| matches!(cause, Cause::FewReflectors(_))) {
            format!("put up more reflectors, or look why they are not seen: agv view {log}")
        } else if has(|cause| matches!(cause, Cause::EncodersSwapped)) {
            "exchange the plugs, or what agv ctl HOST set can.drive_node and can.steering_node say; drive and check again"
                .to_owned()
        } else if self.is_mendable() {
            format!("agv calibrate {log} --mend --apply vehicle.toml")
        } else {
            "turn the steering encoder by half a turn, or preset it (object 6003h); drive and check again".to_owned()
        }
    }
}

/// Reflectors that must be seen at once.
pub const FEWEST_REFLECTORS: usize = 3;
/// Explanations that leave more noise than the best by this factor are none.
const NOISIER: f64 = 2.0;
/// Differences of the laser's heading (rad) and place (m) and of the wheelbase (share) that are no adjustment any more.
const HEADING: f64 = 0.5 * PI / 180.0;
const PLACE: f64 = 0.05;
const WHEELBASE: f64 = 0.003;
/// The same of the steering offset, rad.
const STEERING: f64 = PI / 180.0;
/// All of them for a day's drive, in which slip and drift of the heading are mistaken for them.
const ROUGH: [f64; 4] = [PI / 180.0, 0.08, 0.012, 1.5 * PI / 180.0];
/// Offsets of the steering beyond it are half a turn, rad.
const HALF_TURN: f64 = 0.75 * PI;
/// Angles that differ by less are one mistake, rad.
const SAME_ANGLE: f64 = 0.1;
/// In standard deviations.
const CLEAR: f64 = 4.0;

const QUESTION: Question = Question {
    method: Method::Joint,
    offsets: Offsets::ForEachSense,
    is_wheelbase_free: true,
    is_steering_ratio_free: false,
    side: None,
};

/// What a drive may tell, from a drive that was made for it down to one that only goes forward.
pub const QUESTIONS: [Question; 3] = [
    QUESTION,
    Question { offsets: Offsets::Common, ..QUESTION },
    Question { offsets: Offsets::Common, is_wheelbase_free: false, ..QUESTION },
];

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

    /// Sets of mistakes that do the same, and whether the driving wheel looks the other way under each.
    fn sets(self) -> Vec<(Vec<Cause>, bool)> {
        let mut common = Vec::new();
        common.extend(self.swapped.then_some(Cause::EncodersSwapped));
        common.extend(self.reversed.then_some(Cause::SteeringReversed));
        let offset = |quarters: u8| match quarters % 4 {
            0 => None,
            quarters => Some(Cause::SteeringOffset(wrap(f64::from(quarters) * FRAC_PI_2))),
        };
        let set = |is_drive_reversed: bool| {
            let offset = offset(self.quarters + 2 * u8::from(is_drive_reversed));
            let drive = is_drive_reversed.then_some(Cause::DriveReversed);
            (common.iter().copied().chain(drive).chain(offset).collect(), is_drive_reversed)
        };
        vec![set(false), set(true)]
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
        return vec![Explanation { causes: vec![Cause::FewReflectors(seen)], noise: f64::NAN, is_wheel_behind: false }];
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
        if candidates.iter().any(|candidate: &Explanation| candidate.weight() <= 1) {
            break;
        }
    }
    simplest(candidates)
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
    let Ok(drive) = Drive::among_few(&right) else { return Vec::new() };
    let Ok((found, drive)) = find_any(drive, &QUESTIONS) else { return Vec::new() };
    let nominal = VehicleModel::nominal(tricycle, input.parameters.lasers.first());
    let measured = differences(&found, &nominal, drive.is_from_stops());
    let (noise, is_behind) = (level(&found), is_wheel_behind(&drive.counted, &found.model));
    let explanation = |(set, is_other_way): (Vec<Cause>, bool)| Explanation {
        causes: together(set, &measured),
        noise,
        is_wheel_behind: is_behind != is_other_way,
    };
    undone.sets().into_iter().map(explanation).collect()
}

/// Mistakes that were undone with what was measured beside them: an offset of the steering is one.
fn together(mut causes: Vec<Cause>, measured: &[Cause]) -> Vec<Cause> {
    for cause in measured {
        let known = causes.iter_mut().find_map(|known| match known {
            Cause::SteeringOffset(offset) => Some(offset),
            _ => None,
        });
        match (cause, known) {
            (Cause::SteeringOffset(more), Some(offset)) => *offset = wrap(*offset + more),
            _ => causes.push(*cause),
        }
    }
    causes
}

/// Whether the driving wheel looks back rather than ahead for most of the way.
fn is_wheel_behind(counted: &[Counted], model: &VehicleModel) -> bool {
    let ahead = |pair: &[Counted]| {
        let way = (pair[1].ticks - pair[0].ticks).abs();
        way * (pair[1].steering + model.offset_forward).cos()
    };
    counted.windows(2).map(ahead).sum::<f64>() < 0.0
}

/// How much noise is left, by the usual one.
fn level(found: &Found) -> f64 {
    let usual = super::noise::NoiseModel::default();
    (found.noise.slip / usual.slip).max(found.noise.steering / usual.steering)
}

/// Parameters that are not those of the log; more is asked of those from a drive that does not go from stop to stop.
#[must_use]
pub fn differences(found: &Found, nominal: &VehicleModel, is_from_stops: bool) -> Vec<Cause> {
    let [heading_limit, place_limit, wheelbase_limit, steering_limit] =
        if is_from_stops { [HEADING, PLACE, WHEELBASE, STEERING] } else { ROUGH };
    let [forward, backward, _, wheelbase, _, x, y, heading] = found.deviations;
    let mut causes = Vec::new();
    let offsets = |model: &VehicleModel| [model.offset_forward, model.offset_backward];
    let [ahead, back] = [0, 1].map(|sense| wrap(offsets(&found.model)[sense] - offsets(nominal)[sense]));
    let offset = wrap(ahead + 0.5 * wrap(back - ahead));
    if offset.abs() > (CLEAR * forward.max(backward)).max(steering_limit) {
        causes.push(Cause::SteeringOffset(offset));
    }
    let stretch = found.model.wheelbase - nominal.wheelbase;
    if stretch.abs() > (CLEAR * wheelbase).max(wheelbase_limit * nominal.wheelbase) {
        causes.push(Cause::Wheelbase(found.model.wheelbase));
    }
    let turn = wrap(found.model.laser.theta - nominal.laser.theta);
    if turn.abs() > (CLEAR * heading).max(heading_limit) {
        causes.push(Cause::LaserHeading(turn));
    }
    let (ahead, left) = (found.model.laser.x - nominal.laser.x, found.model.laser.y - nominal.laser.y);
    if ahead.abs() > (CLEAR * x).max(place_limit) || left.abs() > (CLEAR * y).max(place_limit) {
        causes.push(Cause::LaserPlace(ahead, left));
    }
    causes
}

/// Those that leave little noise, and of these the ones with the fewest mistakes; each once.
fn simplest(mut candidates: Vec<Explanation>) -> Vec<Explanation> {
    let least = candidates.iter().map(|candidate| candidate.noise).fold(f64::INFINITY, f64::min);
    candidates.retain(|candidate| candidate.noise <= NOISIER * least.max(0.1));
    let fewest = candidates.iter().map(Explanation::weight).min().unwrap_or_default();
    candidates.retain(|candidate| candidate.weight() == fewest);
    candidates.sort_by(|a, b| a.noise.total_cmp(&b.noise));
    let mut each: Vec<Explanation> = Vec::new();
    for candidate in candidates {
        if !each.iter().any(|known| known.is_like(&candidate)) {
            each.push(candidate);
        }
    }
    each
}
