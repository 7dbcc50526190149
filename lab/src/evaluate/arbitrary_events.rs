//! What the localiser does with arbitrary events.

use rayon::prelude::*;
use serde::Serialize;

use crate::campaign::event_fuzz;

/// What the localiser did with arbitrary events.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
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
