//! What is wrong with a vehicle of any wheels whose counters and laser do not tell one motion: mistakes of hands are undone in turn, what
//! is left is fitted, and the fewest that make sense of the drive are named.

mod measured;
mod undone;

use std::fmt;

use agv_core::geometry::wrap;
use agv_core::measurement::Time;
use agv_core::odometry::{Counted, WheelParameter};
use nalgebra::Vector3;

use super::super::log_input::LogInput;
use super::clock::Clock;
use super::drive::WheelDrive;
use super::fit::fit;
use super::fitted_vehicle::{fitted_vehicle, has_setting};
use super::log_drive::LogDrive;
use super::path::LinearisedPath;
use super::unknowns::{Moves, Unknown, WheeledModel};
use super::windows::{self, Window};
use measured::measured;
use undone::{Undone, hypotheses};

/// One thing that is wrong.
#[derive(Clone, Debug, PartialEq)]
pub enum Mistake {
    /// A counter counts the wrong way.
    Reversed {
        /// Its wheel, from 0.
        wheel: usize,
        /// What it counts.
        counted: Counted,
    },
    /// All wheels count the wrong way.
    AllReversed,
    /// Each of two counters is taken for the other.
    Swapped(usize, usize),
    /// The steering of a wheel is off by about so much, rad.
    SteeringOffset(usize, f64),
    /// A tick of all wheels is so many times as long as is believed.
    Scale(f64),
    /// The same of one wheel.
    WheelScale(usize, f64),
    /// A distance of the wheels has another length, m: which, and how long it is.
    Length(String, f64),
    /// The laser looks in another direction: by so much, rad.
    LaserHeading(f64),
    /// The laser is elsewhere: by so much ahead and to the left, m.
    LaserPlace(f64, f64),
    /// The laser's times are so late for those of the wheels, s; early if it is negative.
    Late(f64),
}

impl fmt::Display for Mistake {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Reversed { wheel, counted: Counted::Turn } => {
                write!(formatter, "the counter of wheel {} counts the wrong way", wheel + 1)
            }
            Self::Reversed { wheel, counted: Counted::Steering } => {
                write!(formatter, "the steering counter of wheel {} counts the wrong way", wheel + 1)
            }
            Self::AllReversed => write!(formatter, "all wheels count the wrong way"),
            Self::Swapped(first, second) => {
                write!(formatter, "the counters of the wheels {} and {} are exchanged", first + 1, second + 1)
            }
            Self::SteeringOffset(wheel, angle) => {
                write!(formatter, "the steering offset of wheel {} is off by {:.1} deg", wheel + 1, angle.to_degrees())
            }
            Self::Scale(ratio) => write!(formatter, "a tick of the wheels is {ratio:.3} times as long as is believed"),
            Self::WheelScale(wheel, ratio) => {
                write!(formatter, "a tick of wheel {} is {ratio:.3} times as long as is believed", wheel + 1)
            }
            Self::Length(name, length) => write!(formatter, "the {name} is {length:.3} m"),
            Self::LaserHeading(turn) => write!(formatter, "the laser is turned by {:.1} deg", turn.to_degrees()),
            Self::LaserPlace(x, y) => write!(
                formatter,
                "the laser is {:.0} mm further ahead and {:.0} mm further to the left",
                1e3 * x,
                1e3 * y
            ),
            Self::Late(late) => {
                let side = if *late > 0.0 { "late" } else { "early" };
                write!(formatter, "the laser's times are {:.0} ms too {side} for the wheels", 1e3 * late.abs())
            }
        }
    }
}

impl Mistake {
    /// Whether that number is what mends it.
    fn is_mended_by(&self, unknown: &Unknown) -> bool {
        let of_wheel = |wanted: WheelParameter, wheel: Option<usize>| match &unknown.moves {
            Moves::Wheels(moves) => moves
                .iter()
                .any(|(number, parameter, _)| *parameter == wanted && wheel.is_none_or(|wheel| wheel == *number)),
            Moves::Sensor(_) => false,
        };
        match self {
            Self::SteeringOffset(wheel, _) => of_wheel(WheelParameter::Heading, Some(*wheel)),
            Self::Scale(_) => of_wheel(WheelParameter::Radius, None),
            Self::WheelScale(wheel, _) => of_wheel(WheelParameter::Radius, Some(*wheel)),
            Self::Length(name, _) => unknown.name.trim_end_matches(" m") == name,
            Self::LaserHeading(_) => unknown.moves == Moves::Sensor(2),
            Self::LaserPlace(..) => matches!(unknown.moves, Moves::Sensor(0 | 1)),
            Self::Reversed { .. } | Self::AllReversed | Self::Swapped(..) | Self::Late(_) => false,
        }
    }
}

/// Mistakes that make sense of a drive together; none if it makes sense as it is.
#[derive(Clone, Debug, PartialEq)]
pub struct WheelExplanation {
    /// The mistakes.
    pub mistakes: Vec<Mistake>,
    /// What wheels and laser then still say differently of two seconds, m.
    pub residual: f64,
    /// The log of a vehicle of which they are mended, but for a clock.
    pub mended: LogInput,
    /// What was measured for that; the rest is as it was believed, if that will do: a drive that shows a mistake need not tell all of
    /// the vehicle.
    pub unknowns: Vec<Unknown>,
}

impl WheelExplanation {
    /// Whether settings mend it.
    #[must_use]
    pub fn is_mendable(&self) -> bool {
        let is_not = |mistake: &Mistake| matches!(mistake, Mistake::Swapped(..) | Mistake::Late(_));
        !self.mistakes.is_empty() && !self.mistakes.iter().any(is_not)
    }

    /// By how much the laser's times are late, s.
    #[must_use]
    pub fn late(&self) -> Option<f64> {
        self.mistakes.iter().find_map(|mistake| if let Mistake::Late(late) = mistake { Some(*late) } else { None })
    }

    /// What to do about it, with commands that name the log so.
    #[must_use]
    pub fn remedy(&self, log: &str) -> String {
        if self.late().is_some() {
            format!("agv check {log} --put-right mended.agvlog")
        } else if self.mistakes.iter().any(|mistake| matches!(mistake, Mistake::Swapped(..))) {
            "exchange the plugs, or the nodes (agv settings can); drive and check again".to_owned()
        } else {
            format!("agv calibrate {log} --mend --apply vehicle.toml")
        }
    }
}

impl fmt::Display for WheelExplanation {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words: Vec<String> = self.mistakes.iter().map(ToString::to_string).collect();
        formatter.write_str(&words.join(", and "))
    }
}

/// Explanations that leave more than the best by this factor are none; and never less than this is asked for, m.
const WORSE: f64 = 1.5;
const FINE: f64 = 0.004;
/// A drive makes no sense if more is left, as a share of the motion.
const POOR: f64 = 0.25;
/// Ratios of all ticks beyond which they are set right before anything is fitted.
const OTHER_SCALE: f64 = 1.1;
/// All explanations with the fewest mistakes, the best first. Empty if nothing makes sense of the drive, or it says too little.
/// `progress` is called with the tries done, and how many there are.
#[must_use]
pub fn explain_wheels(input: &LogInput, mut progress: impl FnMut(usize, usize)) -> Vec<WheelExplanation> {
    let short = thinned(input);
    let (pairs, single): (Vec<Undone>, Vec<Undone>) =
        hypotheses(&short).into_iter().partition(|undone| undone.mistakes.len() > 1);
    let mut found: Vec<WheelExplanation> = Vec::new();
    let mut done = 0;
    for group in [single, pairs] {
        // What is more than one mistake before the fit is looked at only if less does not do.
        if found.iter().any(|one| one.mistakes.len() <= 1 && one.residual < FINE) {
            break;
        }
        for undone in promising(group) {
            progress(done, 2 * FITTED);
            done += 1;
            found.extend(explanation(undone));
        }
    }
    let mut simplest = simplest(found);
    // What is mended is the log as it was.
    for explanation in &mut simplest {
        let parameters = explanation.mended.parameters;
        explanation.mended = LogInput { parameters, ..input.clone() };
    }
    simplest
}

/// Hypotheses of a group that are fitted at the most.
const FITTED: usize = 6;
/// Time between samples of the wheels, s, and length of the drive, s, that tell mistakes.
const SPACING: f64 = 0.045;
const LONGEST: f64 = 180.0;

/// Fewer samples of the wheels, and no more than some minutes of the drive.
fn thinned(input: &LogInput) -> LogInput {
    let mut short = input.clone();
    let first = short.poses().first().map(|pose| pose.time);
    let is_within = |time: Time| first.is_none_or(|first| time.since(first) < LONGEST);
    let mut last: Option<Time> = None;
    let mut is_wanted = |time: Time| {
        let wanted = is_within(time) && last.is_none_or(|last| time.since(last) >= SPACING);
        if wanted {
            last = Some(time);
        }
        wanted
    };
    short.wheels.retain(|sample| is_wanted(sample.time));
    short.encoders.retain(|sample| is_wanted(sample.time));
    short.laser_poses.retain(|pose| is_within(pose.time));
    short.given_poses.retain(|pose| is_within(pose.time));
    short
}

/// Those of a group under which most of the motion makes sense before anything is fitted; that nothing was done first of all.
fn promising(group: Vec<Undone>) -> Vec<Undone> {
    let left = |undone: &Undone| -> Option<f64> {
        let LogDrive { nominal, drive, .. } = LogDrive::new(&undone.input).ok()?;
        let path = LinearisedPath::new(&drive, &rough(&drive, &nominal)?, &[])?;
        let squares = windows::of(0, &drive).into_iter().map(|window| {
            let values = window.residual(&path, &Clock::default()).values;
            // A few windows that slip weigh no more than others.
            (values[0].hypot(values[1])).min(FAR) + (super::fit::HEADING_ARM * values[2].abs()).min(FAR)
        });
        Some(squares.sum())
    };
    let mut rated: Vec<(f64, Undone)> = group
        .into_iter()
        .filter_map(|undone| {
            let left = left(&undone)?;
            Some((if undone.mistakes.is_empty() { 0.0 } else { left }, undone))
        })
        .collect();
    rated.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    rated.truncate(FITTED);
    rated.into_iter().map(|(_, undone)| undone).collect()
}

/// Differences of a window beyond which all are alike, m.
const FAR: f64 = 1.0;

fn simplest(mut found: Vec<WheelExplanation>) -> Vec<WheelExplanation> {
    // A tick of about minus one tick is a counter that counts the wrong way.
    let is_reversed = |mistake: &Mistake| match mistake {
        Mistake::WheelScale(wheel, ratio) if (*ratio + 1.0).abs() < measured::SHARE => Some(*wheel),
        _ => None,
    };
    let best = found.iter().map(|one| one.residual).fold(f64::INFINITY, f64::min);
    found.retain(|one| one.residual <= WORSE * best.max(FINE));
    let reversed: Vec<usize> = found.iter().flat_map(|one| one.mistakes.iter().filter_map(turned)).collect();
    found.retain(|one| !one.mistakes.iter().filter_map(is_reversed).any(|wheel| reversed.contains(&wheel)));
    let weight = |one: &WheelExplanation| {
        one.mistakes.iter().map(|mistake| if matches!(mistake, Mistake::LaserPlace(..)) { 2 } else { 1 }).sum::<usize>()
    };
    let fewest = found.iter().map(weight).min().unwrap_or_default();
    found.retain(|one| weight(one) == fewest);
    found.sort_by(|a, b| a.residual.total_cmp(&b.residual));
    let mut each: Vec<WheelExplanation> = Vec::new();
    for one in found {
        let is_like = |other: &WheelExplanation| other.to_string() == one.to_string();
        if !each.iter().any(is_like) {
            each.push(one);
        }
    }
    each.truncate(MOST);
    each
}

/// The wheel of which a counter of turns counts the wrong way.
const fn turned(mistake: &Mistake) -> Option<usize> {
    match mistake {
        Mistake::Reversed { wheel, counted: Counted::Turn } => Some(*wheel),
        _ => None,
    }
}

/// Explanations that are told at the most.
const MOST: usize = 2;

/// What is wrong beside what was undone; none if the drive then makes no sense.
fn explanation(undone: Undone) -> Option<WheelExplanation> {
    let LogDrive { kind, nominal, drive } = LogDrive::new(&undone.input).ok()?;
    let start = rough(&drive, &nominal)?;
    // Directions of wheels and rollers are those of the vehicle's kind.
    let unknowns: Vec<Unknown> = Unknown::of(kind, &start.wheels, true).into_iter().filter(has_setting).collect();
    let found = fit(std::slice::from_ref(&drive), &start, &unknowns, true).ok()?;
    let motion = motion(&windows::of(0, &drive));
    if found.residual > POOR * motion {
        return None;
    }
    let mut mistakes = undone.mistakes.clone();
    let measured = measured(&nominal, &found, &unknowns);
    add(&mut mistakes, measured);
    let is_named = |unknown: &&Unknown| mistakes.iter().any(|mistake| mistake.is_mended_by(unknown));
    let named: Vec<Unknown> = unknowns.iter().filter(is_named).cloned().collect();
    // What is alike of all wheels is one number: where the wheels are free, the place of the laser hides in them.
    let is_scaled = mistakes.iter().any(|mistake| matches!(mistake, Mistake::Scale(_)));
    let common = is_scaled.then(|| Unknown::with_common_radius(&named, &start.wheels));
    let fitted = common.into_iter().chain([named]).find_map(|named| {
        let only = fit(std::slice::from_ref(&drive), &start, &named, true).ok()?;
        (only.residual <= WORSE * found.residual.max(FINE)).then_some((only.model, named))
    });
    let (model, unknowns) = fitted.unwrap_or((found.model, unknowns));
    let mut mended = undone.input.clone();
    mended.parameters.vehicle = fitted_vehicle(&mended.parameters.vehicle, &model)?;
    *mended.parameters.lasers.first_mut() = model.sensor;
    Some(WheelExplanation { mistakes, residual: found.residual, mended, unknowns })
}

/// What was measured beside what was undone: an offset of one steering is one.
fn add(mistakes: &mut Vec<Mistake>, measured: Vec<Mistake>) {
    for more in measured {
        let known = mistakes.iter_mut().find_map(|known| match (known, &more) {
            (Mistake::SteeringOffset(wheel, angle), Mistake::SteeringOffset(other, _)) if wheel == other => Some(angle),
            _ => None,
        });
        match (known, more) {
            (Some(angle), Mistake::SteeringOffset(_, more)) => *angle = wrap(*angle + more),
            (_, more) => mistakes.push(more),
        }
    }
}

/// The believed vehicle with its laser turned, and its wheels as large, as the drive says at a glance: a fit finds what is near it. None if
/// hardly anything moves, or the wheels tell no motion.
fn rough(drive: &WheelDrive, nominal: &WheeledModel) -> Option<WheeledModel> {
    let path = LinearisedPath::new(drive, nominal, &[])?;
    let clock = Clock::default();
    let (mut dot, mut cross, mut seen_square, mut said_square) = (0.0, 0.0, 0.0, 0.0);
    for window in windows::of(0, drive) {
        let said = displacement(
            &path.sensor_at(window.start.time, &clock).pose,
            &path.sensor_at(window.end.time, &clock).pose,
        );
        let seen = seen(&window);
        // Of long arcs the chord depends on the place of the laser.
        if seen.z.abs() > 0.3 || said.z.abs() > 0.3 {
            continue;
        }
        dot += said.x * seen.x + said.y * seen.y;
        cross += said.x * seen.y - said.y * seen.x;
        seen_square += seen.x * seen.x + seen.y * seen.y;
        said_square += said.x * said.x + said.y * said.y;
    }
    let mut model = nominal.clone();
    if seen_square < 0.1 || said_square < 1e-6 {
        return (said_square >= 1e-6 || seen_square < 0.1).then_some(model);
    }
    // A laser that is turned to the left sees the motion turned to the right.
    let turn = -libm::atan2(cross, dot);
    if turn.abs() > ROUGH_TURN {
        model.sensor.theta = wrap(model.sensor.theta + turn);
    }
    let ratio = (seen_square / said_square).sqrt();
    if !(1.0 / OTHER_SCALE..=OTHER_SCALE).contains(&ratio) {
        model.wheels.iter_mut().for_each(|wheel| wheel.radius *= ratio);
    }
    Some(model)
}

/// Turns of the laser below which the fit alone finds them, rad.
const ROUGH_TURN: f64 = 0.15;

fn displacement(first: &Vector3<f64>, second: &Vector3<f64>) -> Vector3<f64> {
    let (sine, cosine) = first.z.sin_cos();
    let change = second - first;
    Vector3::new(cosine * change.x + sine * change.y, cosine * change.y - sine * change.x, change.z)
}

fn seen(window: &Window) -> Vector3<f64> {
    let vector = |pose: &super::drive::TimedPose| Vector3::new(pose.x, pose.y, pose.heading);
    displacement(&vector(&window.start), &vector(&window.end))
}

/// Root of the mean square of what the poses move in a window, m, as residuals count it.
fn motion(windows: &[Window]) -> f64 {
    let square = |window: &Window| {
        let seen = seen(window);
        seen.x * seen.x + seen.y * seen.y + (super::fit::HEADING_ARM * seen.z).powi(2)
    };
    (windows.iter().map(square).sum::<f64>() / (3 * windows.len().max(1)) as f64).sqrt()
}
