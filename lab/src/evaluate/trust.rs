//! What happens when things go wrong, in ten figures.

use rayon::prelude::*;
use serde::Serialize;

use crate::campaign::event_fuzz;
use crate::campaign::results::Row;
use crate::campaign::soak::Hour;
use crate::campaign::verdict::Class;
use agv_host_sim::accuracy::Spread;

/// The figures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Trust {
    /// Kinds of faults.
    pub faults: usize,
    /// Runs with one or two of them.
    pub runs: usize,
    /// Runs in which the error was above the alert limit for longer than may be, unsaid.
    pub misleading: usize,
    /// How long the error was larger than what was reported before that was said, s: at the 95 % mark of those runs in which
    /// there was something to say.
    pub late_s_p95: f64,
    /// How far the vehicle went meanwhile, m, likewise.
    pub late_m_p95: f64,
    /// Of the runs that let the vehicle localise again, the share of those in which it did.
    pub recovered_share: f64,
    /// Times an hour in which the error was larger than the protection level though nothing was wrong.
    pub protection_level_violations_per_h: f64,
    /// Panics of runs and of the localiser that was told arbitrary events.
    pub panics: usize,
    /// Hours of the soak.
    pub soak_hours: usize,
    /// Arbitrary events that the localiser was told.
    pub fuzz_events: u64,
    /// After how many of them an output broke what must always hold.
    pub fuzz_violations: usize,
}

/// What the localiser did with arbitrary events.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Fuzzed {
    /// Events.
    pub events: u64,
    /// Outputs that broke what must always hold.
    pub violations: usize,
    /// Panics.
    pub panics: usize,
}

/// Events of one seed.
const EVENTS_A_SEED: u64 = 10_000;

/// Tells localisers that many arbitrary events, rounded up to whole seeds. `done` is called after each seed.
#[must_use]
pub fn fuzz(events: u64, done: impl Fn() + Sync) -> Fuzzed {
    let seeds = events.div_ceil(EVENTS_A_SEED);
    let add = |a: Fuzzed, b: Fuzzed| Fuzzed {
        events: a.events + b.events,
        violations: a.violations + b.violations,
        panics: a.panics + b.panics,
    };
    (1..=seeds)
        .into_par_iter()
        .map(|seed| {
            let verdict = event_fuzz::run(seed, EVENTS_A_SEED);
            done();
            Fuzzed { events: verdict.events, violations: verdict.violations.len(), panics: verdict.panics.len() }
        })
        .reduce(Fuzzed::default, add)
}

/// Number of seeds of [`fuzz`].
#[must_use]
pub const fn fuzz_seeds(events: u64) -> u64 {
    events.div_ceil(EVENTS_A_SEED)
}

/// Puts the figures together. `faults` is the number of kinds.
#[must_use]
pub fn figures(faults: usize, rows: &[Row], hours: &[Hour], fuzzed: &Fuzzed) -> Trust {
    let count = |is: fn(&Row) -> bool| rows.iter().filter(|row| is(row)).count();
    let had_to_say = |row: &&Row| row.class().is_some_and(|class| class != Class::Unimpressed);
    let late = |value: fn(&Row) -> f64| Spread::of(rows.iter().filter(had_to_say).map(value)).p95;
    let violations: u32 = hours.iter().map(|hour| hour.violations).sum();
    Trust {
        faults,
        runs: rows.len(),
        misleading: count(|row| row.class() == Some(Class::Misleading)),
        late_s_p95: late(|row| row.late_s),
        late_m_p95: late(|row| row.late_m),
        recovered_share: count(|row| row.can_recover && row.is_recovered) as f64
            / count(|row| row.can_recover).max(1) as f64,
        protection_level_violations_per_h: f64::from(violations) / hours.len().max(1) as f64,
        panics: count(Row::has_panicked) + fuzzed.panics,
        soak_hours: hours.len(),
        fuzz_events: fuzzed.events,
        fuzz_violations: fuzzed.violations,
    }
}
