//! The noise of what is seen, from the innovations of a drive: what the filter is told is changed until the squared
//! innovations are what it expects, on the first half of the drive, and is then held against the second half.
//!
//! The mean of the normalised squared innovation of two components is 2 if the noise is right (Bar-Shalom, Li, Kirubarajan,
//! Estimation with Applications to Tracking and Navigation, 5.4.2); here it is stated for one degree of freedom.

use agv_core::localizer::{LandmarkUse, Parameters, bounds};
use agv_core::maps::{LandmarkKind, Verdict};
use agv_core::measurement::Time;

use crate::recording::{RecordedEvent, Recording};
use crate::replay::{ReplayError, replay};

/// What is seen, as its noise is set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Reflectors.
    Reflectors,
    /// Corners and end points.
    Features,
}

impl Source {
    /// All sources.
    pub const ALL: [Self; 2] = [Self::Reflectors, Self::Features];

    /// In words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Reflectors => "reflectors",
            Self::Features => "natural features",
        }
    }

    fn is_of(self, kind: LandmarkKind) -> bool {
        (kind == LandmarkKind::Reflector) == (self == Self::Reflectors)
    }

    /// The settings that say its noise.
    const fn settings(self) -> [&'static str; 2] {
        match self {
            Self::Reflectors => ["reflectors.range_deviation", "reflectors.bearing_deviation"],
            Self::Features => ["features.added_deviation", "association.shared_map_error"],
        }
    }
}

/// The innovations of one source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Squares {
    /// How many observations.
    pub count: usize,
    /// Mean squared innovation by the one that is expected, for a degree of freedom; 1 if the noise is right.
    pub mean: f64,
    /// The same of each component.
    components: [f64; 2],
}

/// A setting and what becomes of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Changed {
    /// Its name.
    pub name: &'static str,
    /// What it was.
    pub before: f64,
    /// What it is to be.
    pub after: f64,
}

/// The noise of one source.
#[derive(Clone, Debug, PartialEq)]
pub struct SourceNoise {
    /// Of what.
    pub source: Source,
    /// First half, as the log was.
    pub before: Squares,
    /// First half, with the changed settings.
    pub after: Squares,
    /// Second half, with the changed settings: it had no part in them.
    pub check: Squares,
    /// The settings.
    pub settings: [Changed; 2],
}

impl SourceNoise {
    /// Whether the second half agrees.
    #[must_use]
    pub fn is_good(&self) -> bool {
        self.check.count >= FEWEST && HONEST.contains(&self.check.mean)
    }
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
/// Rounds of replay and change.
const ROUNDS: usize = 12;
/// Means that are near enough to one while the settings are changed.
const NEAR: std::ops::RangeInclusive<f64> = 0.97..=1.03;
/// Largest change of a variance in a round.
const LARGEST_STEP: f64 = 9.0;

/// Finds the noise of every source that the drive has seen often enough. `progress` is called with the rounds done, of
/// [`STEPS`].
///
/// # Errors
/// See [`NoiseError`].
pub fn find(recording: &Recording, mut progress: impl FnMut(usize)) -> Result<Vec<SourceNoise>, NoiseError> {
    let middle = middle(recording).ok_or(NoiseError::TooLittle)?;
    let first = Recording { events: until(recording, middle), ..recording.clone() };
    let mut parameters = recording.parameters;
    let before = squares(&first, &parameters, |_| true)?;
    let is_seen = |(_, squares): &(Source, Squares)| squares.count >= FEWEST;
    let sources: Vec<(Source, Squares)> = Source::ALL.into_iter().zip(before).filter(is_seen).collect();
    if sources.is_empty() {
        return Err(NoiseError::TooLittle);
    }
    let mut after = before;
    for round in 0..ROUNDS {
        progress(round);
        if sources.iter().all(|(source, _)| NEAR.contains(&after[*source as usize].mean)) {
            break;
        }
        for (source, _) in &sources {
            change(&mut parameters, *source, &after[*source as usize], &recording.parameters);
        }
        after = squares(&first, &parameters, |_| true)?;
    }
    let check = squares(recording, &parameters, |used| used.time > middle)?;
    progress(STEPS);
    let noise = |(source, before): (Source, Squares)| SourceNoise {
        source,
        before,
        after: after[source as usize],
        check: check[source as usize],
        settings: source.settings().map(|name| Changed {
            name,
            before: value(&recording.parameters, name),
            after: value(&parameters, name),
        }),
    };
    let found: Vec<SourceNoise> = sources.into_iter().map(noise).collect();
    if found.iter().any(|noise| noise.check.count < FEWEST) { Err(NoiseError::TooLittle) } else { Ok(found) }
}

/// Steps that [`find`] tells.
pub const STEPS: usize = ROUNDS;

/// When half of the drive is over.
fn middle(recording: &Recording) -> Option<Time> {
    let times = || recording.events.iter().filter_map(RecordedEvent::time);
    let (first, last) = (times().min()?, times().max()?);
    Some(first.offset(0.5 * last.since(first)))
}

fn until(recording: &Recording, end: Time) -> Vec<RecordedEvent> {
    let is_before = |event: &&RecordedEvent| event.time().is_none_or(|time| time <= end);
    recording.events.iter().filter(is_before).cloned().collect()
}

/// The innovations of each source.
fn squares(
    recording: &Recording,
    parameters: &Parameters,
    counts: impl Fn(&LandmarkUse) -> bool,
) -> Result<[Squares; 2], ReplayError> {
    let replay = replay(&Recording { parameters: *parameters, ..recording.clone() }, |_| ())?;
    let gate = parameters.association.gate;
    let of = |source: Source| {
        let used = replay
            .uses
            .iter()
            .filter(|used| used.verdict == Verdict::Accepted && source.is_of(used.kind) && counts(used));
        let used: Vec<&LandmarkUse> = used.collect();
        let mean = |value: &dyn Fn(&LandmarkUse) -> f64| {
            used.iter().map(|used| value(used)).sum::<f64>() / used.len().max(1) as f64
        };
        let component = |index: usize| mean(&|used| (used.residual[index] / used.residual_deviation[index]).powi(2));
        Squares {
            count: used.len(),
            mean: 0.5 * mean(&|used| used.test_ratio * gate),
            components: [component(0), component(1)],
        }
    };
    Ok(Source::ALL.map(of))
}

/// Changes the noise of a source by what its innovations say.
fn change(parameters: &mut Parameters, source: Source, seen: &Squares, original: &Parameters) {
    let step = |ratio: f64| ratio.clamp(1.0 / LARGEST_STEP, LARGEST_STEP);
    match source {
        Source::Reflectors => {
            let [range, bearing] = seen.components.map(|ratio| step(ratio).sqrt());
            let [first, second] = source.settings();
            set(parameters, first, range * value(parameters, first));
            set(parameters, second, bearing * value(parameters, second));
        }
        Source::Features => {
            let [added, shared] = source.settings();
            // What was nothing cannot grow by a factor.
            let least = 1e-3;
            set(parameters, added, (step(seen.mean).sqrt() * value(parameters, added)).max(least));
            // More than the log's is never believed of a place in the map; once is the least.
            let most = value(original, shared).max(1.0);
            set(parameters, shared, (step(seen.mean) * value(parameters, shared)).clamp(1.0, most));
        }
    }
}

fn place<'a>(parameters: &'a mut Parameters, name: &str) -> Option<&'a mut f64> {
    match name {
        "reflectors.range_deviation" => Some(&mut parameters.reflectors.range_deviation),
        "reflectors.bearing_deviation" => Some(&mut parameters.reflectors.bearing_deviation),
        "features.added_deviation" => Some(&mut parameters.features.added_deviation),
        "association.shared_map_error" => Some(&mut parameters.association.shared_map_error),
        _ => None,
    }
}

fn value(parameters: &Parameters, name: &str) -> f64 {
    let mut copy = *parameters;
    place(&mut copy, name).map_or(f64::NAN, |place| *place)
}

fn set(parameters: &mut Parameters, name: &str, value: f64) {
    let (least, most) = bounds(name).unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
    if let Some(place) = place(parameters, name) {
        *place = value.clamp(least, most);
    }
}
