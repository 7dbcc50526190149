//! The noise of what is seen, from the innovations of a drive: what the filter is told is changed until the innovations of
//! one half of the drive are most likely under it, and is then held against the other half.
//!
//! The mean of the normalised squared innovation of two components is 2 if the noise is right (Bar-Shalom, Li, Kirubarajan,
//! Estimation with Applications to Tracking and Navigation, 5.4.2); here it is stated for one degree of freedom. What is fitted is
//! the likelihood of the components of all innovations (5.5.3 there), each under the deviation that the filter expects of it: so
//! what the sensor does, what the map does, and what the pose does, are weighed against each other by every sighting, where a mean
//! would change one for the other.

use agv_core::localizer::{LandmarkUse, Parameters, bounds};
use agv_core::maps::{LandmarkKind, Verdict};
use agv_core::measurement::Time;
use agv_core::odometry::OdometryNoise;

use crate::drive::KINDS;
use crate::recording::{RecordedEvent, Recording};
use crate::replay::{ReplayError, replay};

/// The innovations of one kind.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Squares {
    /// How many observations.
    pub count: usize,
    /// Mean squared innovation by the one that is expected, for a degree of freedom; 1 if the noise is right.
    pub mean: f64,
}

/// What the filter is told, and what becomes of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Changed {
    /// Name of the setting.
    pub name: &'static str,
    /// What it was.
    pub before: f64,
    /// What it is to be.
    pub after: f64,
}

/// The innovations of one kind before and after.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KindNoise {
    /// Of what.
    pub kind: LandmarkKind,
    /// The fitted half, as the log was.
    pub before: Squares,
    /// The same with what was found.
    pub after: Squares,
    /// The other half, with what was found: it had no part in it.
    pub check: Squares,
}

impl KindNoise {
    /// Whether the other half agrees.
    #[must_use]
    pub fn is_good(&self) -> bool {
        self.check.count >= FEWEST && HONEST.contains(&self.check.mean)
    }
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    /// Every kind that the drive has seen often enough.
    pub kinds: Vec<KindNoise>,
    /// The settings.
    pub settings: Vec<Changed>,
    /// Kinds whose places the map states less or more surely than they are, with the factor of their standard deviations.
    pub map: Vec<(LandmarkKind, f64)>,
    /// The recording with all of that.
    pub recording: Recording,
}

/// Why the noise cannot be found.
#[derive(Clone, Copy, Debug, thiserror::Error, PartialEq, Eq)]
pub enum NoiseError {
    /// The drive cannot be replayed.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// Nothing of the map was seen often enough.
    #[error(
        "too little of the map is seen: each half of the drive needs {FEWEST} observations of a kind that correct the pose"
    )]
    TooLittle,
}

/// Observations that each half of a drive needs.
pub const FEWEST: usize = 100;
/// Means of an honest filter.
pub const HONEST: std::ops::RangeInclusive<f64> = 0.75..=1.25;

/// What is changed, in powers of e.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Knob {
    Setting(&'static str),
    /// Deviations of all landmarks of a kind.
    Map(LandmarkKind),
}

/// Steps of the search, in powers of e, and how often each goes round at most.
const STEPS_OF_SEARCH: [f64; 3] = [1.0, 0.3, 0.1];
const ROUNDS: usize = 3;
/// Steps that [`find`] tells.
pub const STEPS: usize = (STEPS_OF_SEARCH.len() + 1) * ROUNDS;
/// A change that gains less than this share of the observations is none.
const GAIN: f64 = 1e-4;
/// Squares of a component beyond this cost no more: that was something else.
const FARTHEST_SQUARE: f64 = 16.0;
/// Least of what is changed, in the unit of each.
const LEAST: f64 = 1e-4;
/// Factors of what the map states. What the drive from which a map was made shares with it does not show in its innovations.
const MAP: [f64; 2] = [0.25, 4.0];
/// Least factor of reflectors: a survey states them, and how far the pose may be off rests on that.
const SURVEYED: f64 = 0.5;
/// What an observation costs that is no longer compared with anything: too small a noise must not win by losing the vehicle.
const MISSING: f64 = 20.0;

/// Finds the noise of every kind that the drive has seen often enough. `progress` is called with the rounds done, of [`STEPS`].
///
/// # Errors
/// See [`NoiseError`].
pub fn find(recording: &Recording, mut progress: impl FnMut(usize)) -> Result<Noise, NoiseError> {
    let halves = Halves::of(recording).ok_or(NoiseError::TooLittle)?;
    let all = uses(recording)?;
    let squares_of = |uses: &[LandmarkUse], kind, is_fitted| {
        let half: Vec<LandmarkUse> =
            uses.iter().filter(|used| halves.is_fitted(used.time) == is_fitted).copied().collect();
        squares(&half, kind, &recording.parameters)
    };
    let seen: Vec<(LandmarkKind, usize)> = KINDS
        .into_iter()
        .map(|kind| (kind, squares_of(&all, kind, true).count))
        .filter(|(_, count)| *count >= FEWEST)
        .collect();
    if seen.is_empty() {
        return Err(NoiseError::TooLittle);
    }
    let knobs = knobs(&seen);
    let powers = search(recording, &halves, &seen, &knobs, &mut progress)?;
    let right = told(recording, &knobs, &powers);
    let after = uses(&right)?;
    progress(STEPS);
    let kinds = seen.iter().map(|(kind, _)| KindNoise {
        kind: *kind,
        before: squares_of(&all, *kind, true),
        after: squares_of(&after, *kind, true),
        check: squares_of(&after, *kind, false),
    });
    let kinds: Vec<KindNoise> = kinds.collect();
    if kinds.iter().any(|noise| noise.check.count < FEWEST) {
        return Err(NoiseError::TooLittle);
    }
    let settings = knobs.iter().filter_map(|knob| match knob {
        Knob::Setting(name) => {
            Some(Changed { name, before: value(&recording.parameters, name), after: value(&right.parameters, name) })
        }
        Knob::Map(_) => None,
    });
    let map = knobs.iter().zip(&powers).filter_map(|(knob, power)| match knob {
        Knob::Map(kind) => Some((*kind, power.exp())),
        Knob::Setting(_) => None,
    });
    Ok(Noise { kinds, settings: settings.collect(), map: map.collect(), recording: right })
}

/// Odometry beside which what is seen is weighed: noise a sample, and noise of the way.
const ODOMETRY: [&str; 5] =
    ["odometry.speed_deviation", "odometry.steering_deviation", "odometry.slip", "odometry.side_slip", "odometry.yaw"];

fn knobs(seen: &[(LandmarkKind, usize)]) -> Vec<Knob> {
    let has = |wanted| seen.iter().any(|(kind, _)| *kind == wanted);
    // What the map shares between sightings comes first: else the sensor is told the map's noise.
    let mut knobs = vec![Knob::Setting("association.shared_map_error")];
    if has(LandmarkKind::Reflector) {
        knobs.extend(["reflectors.range_deviation", "reflectors.bearing_deviation"].map(Knob::Setting));
    }
    if has(LandmarkKind::Corner) || has(LandmarkKind::EndPoint) {
        knobs.push(Knob::Setting("features.added_deviation"));
    }
    knobs.extend(seen.iter().map(|(kind, _)| Knob::Map(*kind)));
    knobs.extend(ODOMETRY.map(Knob::Setting));
    knobs
}

/// Where else the search begins: odometry that errs with the way and hardly with time, and a map that agrees with itself better than
/// it states, as one does that was surveyed as a whole.
fn of_the_way(first: &Recording, knobs: &[Knob]) -> Vec<f64> {
    let power = |knob: &Knob| {
        let wanted = match knob {
            Knob::Map(_) => 0.2_f64.ln(),
            Knob::Setting(name) => {
                let now = begin(&first.parameters, name);
                let to = match *name {
                    "odometry.speed_deviation" | "odometry.steering_deviation" => 0.1 * now,
                    "odometry.slip" => 0.1,
                    "odometry.side_slip" => 0.05,
                    "odometry.yaw" => 0.02,
                    "association.shared_map_error" => 1.0,
                    _ => 0.4 * now,
                };
                (to / now).ln()
            }
        };
        within(first, *knob, wanted)
    };
    knobs.iter().map(power).collect()
}

/// The powers under which the innovations are most likely.
fn search(
    first: &Recording,
    halves: &Halves,
    seen: &[(LandmarkKind, usize)],
    knobs: &[Knob],
    progress: &mut impl FnMut(usize),
) -> Result<Vec<f64>, NoiseError> {
    let least_gain = GAIN * seen.iter().map(|(_, count)| *count as f64).sum::<f64>();
    let mut starts = Vec::new();
    for powers in [vec![0.0; knobs.len()], of_the_way(first, knobs)] {
        let cost = cost(&told(first, knobs, &powers), halves, seen)?;
        let search = Search { first, halves, seen, knobs, least_gain, powers, cost };
        starts.push(search.with_step(STEPS_OF_SEARCH[0])?);
        progress(starts.len() * ROUNDS);
    }
    starts.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let mut best = starts.swap_remove(0);
    for (index, step) in STEPS_OF_SEARCH.into_iter().enumerate().skip(1) {
        best = best.with_step(step)?;
        progress((index + 2) * ROUNDS);
    }
    Ok(best.powers)
}

/// A place on the way to the least cost.
struct Search<'a> {
    first: &'a Recording,
    halves: &'a Halves,
    seen: &'a [(LandmarkKind, usize)],
    knobs: &'a [Knob],
    least_gain: f64,
    powers: Vec<f64>,
    cost: f64,
}

impl Search<'_> {
    /// Goes along one axis after the other as long as it gains.
    fn with_step(mut self, step: f64) -> Result<Self, ReplayError> {
        for _ in 0..ROUNDS {
            let begun = self.cost;
            for axis in 0..self.knobs.len() {
                for sign in [-1.0, 1.0] {
                    while self.moves(axis, sign * step)? {}
                }
            }
            if self.cost > begun - self.least_gain {
                break;
            }
        }
        Ok(self)
    }

    /// Takes one step if it gains.
    fn moves(&mut self, axis: usize, step: f64) -> Result<bool, ReplayError> {
        let mut tried = self.powers.clone();
        tried[axis] = within(self.first, self.knobs[axis], self.powers[axis] + step);
        if tried[axis] == self.powers[axis] {
            return Ok(false);
        }
        let found = cost(&told(self.first, self.knobs, &tried), self.halves, self.seen)?;
        let gains = found < self.cost - self.least_gain;
        if gains {
            (self.cost, self.powers) = (found, tried);
        }
        Ok(gains)
    }
}

/// A power that leaves what it changes within its bounds.
fn within(recording: &Recording, knob: Knob, power: f64) -> f64 {
    let (least, most) = match knob {
        Knob::Map(LandmarkKind::Reflector) => (SURVEYED.ln(), MAP[1].ln()),
        Knob::Map(_) => (MAP[0].ln(), MAP[1].ln()),
        Knob::Setting(name) => {
            let (least, most) = bounds(name).unwrap_or((LEAST, f64::INFINITY));
            let now = begin(&recording.parameters, name);
            ((least.max(LEAST) / now).ln(), (most / now).ln())
        }
    };
    power.clamp(least, most)
}

/// The recording with what is changed by those powers.
fn told(recording: &Recording, knobs: &[Knob], powers: &[f64]) -> Recording {
    let mut changed = recording.clone();
    for (knob, power) in knobs.iter().zip(powers) {
        match knob {
            Knob::Setting(name) => {
                let now = begin(&recording.parameters, name);
                if let Some(place) = place(&mut changed.parameters, name) {
                    *place = now * power.exp();
                }
            }
            Knob::Map(kind) => {
                let landmarks = changed.landmarks.iter_mut().filter(|landmark| landmark.kind == *kind);
                landmarks.for_each(|landmark| landmark.deviation *= power.exp() as f32);
            }
        }
    }
    changed
}

/// A drive in two halves: pieces of it in turn, as a drive is not the same from its beginning to its end.
struct Halves {
    begin: Time,
    piece: f64,
}

impl Halves {
    fn of(recording: &Recording) -> Option<Self> {
        let times = || recording.events.iter().filter_map(RecordedEvent::time);
        let (first, last) = (times().min()?, times().max()?);
        Some(Self { begin: first, piece: (last.since(first) / f64::from(PIECES)).max(f64::MIN_POSITIVE) })
    }

    /// Whether what happens then is fitted, or else held against it.
    fn is_fitted(&self, time: Time) -> bool {
        (time.since(self.begin) / self.piece).floor() % 2.0 == 0.0
    }
}

/// Pieces into which a drive is cut.
const PIECES: u32 = 16;

/// What was compared with a landmark, and is it or is too far from it.
fn uses(recording: &Recording) -> Result<Vec<LandmarkUse>, ReplayError> {
    let mut uses = replay(recording, |_| ())?.uses;
    uses.retain(|used| matches!(used.verdict, Verdict::Accepted | Verdict::Gated) && used.landmark.is_some());
    Ok(uses)
}

fn squares(uses: &[LandmarkUse], kind: LandmarkKind, parameters: &Parameters) -> Squares {
    let accepted = uses.iter().filter(|used| used.kind == kind && used.verdict == Verdict::Accepted);
    let squares: Vec<f64> = accepted.map(|used| used.test_ratio * parameters.association.gate).collect();
    Squares { count: squares.len(), mean: 0.5 * squares.iter().sum::<f64>() / squares.len().max(1) as f64 }
}

/// Twice the negative logarithm of the likelihood of the components, but for a constant. Each kind counts by how often it was seen
/// at first: what is accepted changes with what is told.
fn cost(recording: &Recording, halves: &Halves, seen: &[(LandmarkKind, usize)]) -> Result<f64, ReplayError> {
    let mut uses = uses(recording)?;
    uses.retain(|used| halves.is_fitted(used.time));
    let of_kind = |(kind, count): &(LandmarkKind, usize)| {
        let of_component = |used: &LandmarkUse, index: usize| {
            let deviation = used.residual_deviation[index].max(f64::MIN_POSITIVE);
            2.0 * deviation.ln() + (used.residual[index] / deviation).powi(2).min(FARTHEST_SQUARE)
        };
        let costs: Vec<f64> = uses
            .iter()
            .filter(|used| used.kind == *kind)
            .map(|used| of_component(used, 0) + of_component(used, 1))
            .collect();
        let missing = MISSING * count.saturating_sub(costs.len()) as f64;
        let mean = costs.iter().sum::<f64>() / costs.len().max(1) as f64;
        *count as f64 * mean + missing
    };
    Ok(seen.iter().map(of_kind).sum())
}

fn place<'a>(parameters: &'a mut Parameters, name: &str) -> Option<&'a mut f64> {
    match name {
        "reflectors.range_deviation" => Some(&mut parameters.reflectors.range_deviation),
        "reflectors.bearing_deviation" => Some(&mut parameters.reflectors.bearing_deviation),
        "features.added_deviation" => Some(&mut parameters.features.added_deviation),
        "association.shared_map_error" => Some(&mut parameters.association.shared_map_error),
        "odometry.speed_deviation" => Some(&mut parameters.odometry_noise.speed),
        "odometry.steering_deviation" => Some(&mut parameters.odometry_noise.steering),
        "odometry.slip" => Some(&mut parameters.odometry_noise.slip),
        "odometry.side_slip" => Some(&mut parameters.odometry_noise.side_slip),
        "odometry.yaw" => Some(&mut parameters.odometry_noise.yaw),
        _ => None,
    }
}

/// From what a setting is changed: one that is nothing cannot grow by a factor.
fn begin(parameters: &Parameters, name: &str) -> f64 {
    let usual = Parameters { odometry_noise: OdometryNoise::default(), ..*parameters };
    let least = if ODOMETRY.contains(&name) { 0.1 * value(&usual, name) } else { LEAST };
    value(parameters, name).max(least).max(LEAST)
}

fn value(parameters: &Parameters, name: &str) -> f64 {
    let mut copy = *parameters;
    place(&mut copy, name).map_or(f64::NAN, |place| *place)
}
