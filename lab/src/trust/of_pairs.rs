//! What pairs of faults have shown.

use serde::Serialize;

use super::exact_bound;
use super::row::{OfSize, Row};

/// What pairs of faults have shown.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct OfPairs {
    /// Pairs that were run.
    pub runs: usize,
    /// Of these, those with an integrity failure or a panic.
    pub failures: usize,
    /// Exact 95 % bound of the share of failures, from above; none of no pair.
    pub bound: Option<f64>,
    /// Events of hazardous outputs.
    pub hmi_events: u64,
    /// Longest time in hazardous outputs of one event, s.
    pub worst_hmi_s: f64,
    /// Longest distance in hazardous outputs of one event, m.
    pub worst_hmi_m: f64,
    /// The pairs that failed, worst first.
    pub failed: Vec<FailedPair>,
}

/// A pair that failed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FailedPair {
    /// The kinds with their sizes.
    pub kinds: [(String, f64); 2],
    /// The seed.
    pub seed: u64,
    /// Longest time in hazardous outputs, s.
    pub hmi_s: f64,
    /// Source that one takes away, if nothing else shows the other.
    pub hidden_by: Option<String>,
}

/// What these pairs have shown; `hidden` gives the source that one of a pair takes away, if nothing else shows the other.
pub(super) fn pairs<'a>(rows: impl Iterator<Item = &'a Row>, hidden: impl Fn(&Row) -> Option<String>) -> OfPairs {
    let of = OfSize { size: 0.0, rows: rows.collect() };
    let failed = of.rows.iter().filter(|row| row.has_failed()).filter_map(|row| {
        Some(FailedPair {
            kinds: [(row.kind.clone(), row.size), row.with.clone()?],
            seed: row.seed,
            hmi_s: row.outcome.as_ref().map_or(0.0, |outcome| outcome.worst_hazard_s),
            hidden_by: hidden(row),
        })
    });
    let mut failed: Vec<FailedPair> = failed.collect();
    failed.sort_by(|a, b| b.hmi_s.total_cmp(&a.hmi_s));
    OfPairs {
        runs: of.rows.len(),
        failures: of.failures(),
        bound: exact_bound::of_share(of.failures() as u64, of.rows.len() as u64),
        hmi_events: of.sum(|outcome| u64::from(outcome.hazards)),
        worst_hmi_s: of.most(|outcome| outcome.worst_hazard_s),
        worst_hmi_m: of.most(|outcome| outcome.worst_hazard_m),
        failed,
    }
}
