//! What the benchmarks have in common.

use std::time::Duration;

use criterion::Criterion;

/// How long each piece of work is measured: all of them together within five minutes of one core.
#[must_use]
pub fn briefly() -> Criterion {
    Criterion::default().warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2))
}
