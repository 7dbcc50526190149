//! What each kind of fault has shown at its worst size.

use std::collections::BTreeMap;

use serde::Serialize;

use super::exact_bound;
use super::judge::{MOST_OVER, STEP};
use super::kinds::Catalogue;
use super::outcome::Found;
use super::row::{OfSize, Row, by_size, worst_size};

/// What a kind of fault has shown at its worst size.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OfKind {
    /// The kind.
    pub kind: String,
    /// Its worst size, and what it is in.
    pub worst_size: f64,
    /// What sizes are in.
    pub unit: String,
    /// Runs at that size.
    pub runs: usize,
    /// Of these, runs with an integrity failure or a panic.
    pub failures: usize,
    /// The same if outputs that are hazardous while no sensor of the vehicle can tell the fault count like all others.
    pub failures_of_all: usize,
    /// Exact 95 % bound of the share of failures, from above.
    pub bound: Option<f64>,
    /// The worst run.
    pub worst_seed: u64,
    /// Longest time in hazardous outputs, s.
    pub worst_hmi_s: f64,
    /// Longest distance in hazardous outputs, m.
    pub worst_hmi_m: f64,
    /// Hazardous outputs, s, while no sensor of the vehicle could tell the fault (class C); in none of the other figures.
    pub hidden_s: f64,
    /// Largest share of error over protection level; none if there was no claim.
    pub error_over_pl_max: Option<f64>,
    /// Share of the time in claims with a protection level within the alert limit of travelling.
    pub share_claimed: f64,
    /// Its class at that size.
    pub class: Class,
    /// Runs in which it was found.
    pub found: usize,
    /// Latest time and distance after which it was found, s and m.
    pub found_s: f64,
    /// See [`Self::found_s`].
    pub found_m: f64,
    /// What has found it most often.
    pub found_by: String,
    /// All its sizes, on the seeds of the sweep by which the worst one was found; empty if they are not known.
    pub sizes: Vec<Swept>,
}

/// What one size of a kind has shown in the sweep.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Swept {
    /// The size.
    pub size: f64,
    /// Runs.
    pub runs: usize,
    /// Of these, runs with an integrity failure or a panic.
    pub failures: usize,
    /// Longest time in hazardous outputs of one event, s.
    pub worst_hmi_s: f64,
    /// Largest share of error over protection level; none if there was no claim, or one without a bound.
    pub error_over_pl_max: Option<f64>,
    /// Share of the time in claims with a protection level within the alert limit of travelling.
    pub share_claimed: f64,
}

impl Swept {
    fn of(of: &OfSize) -> Self {
        Self {
            size: of.size,
            runs: of.rows.len(),
            failures: of.failures(),
            worst_hmi_s: of.most(|outcome| outcome.worst_hazard_s),
            error_over_pl_max: error_over_level(of),
            share_claimed: of.share_claimed(),
        }
    }
}

/// Largest share of error over protection level; none if there was no claim.
fn error_over_level(of: &OfSize) -> Option<f64> {
    let over = of.most(|outcome| outcome.most_over_level);
    let claims = of.sum(|outcome| outcome.claims);
    (claims > 0 && over < MOST_OVER).then_some(over)
}

/// Class of a threat.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Class {
    /// Bounded: the protection level carries it, and nothing is said.
    A,
    /// Found: the vehicle says that something is wrong.
    B,
    /// Not to be found until some way was driven: no sensor of the vehicle can tell.
    C,
}

/// Each kind at its worst size, worst first.
pub(super) fn per_fault(rows: &[&Row], swept: &[Row], catalogue: &Catalogue) -> Vec<OfKind> {
    let mut names: Vec<&str> = Vec::new();
    for row in rows.iter().filter(|row| row.with.is_none()) {
        if !names.contains(&row.kind.as_str()) {
            names.push(&row.kind);
        }
    }
    let of_kind = |name: &str| {
        let sizes = by_size(rows.iter().copied(), name);
        let worst = worst_size(&sizes)?;
        let of = sizes.into_iter().find(|of| of.size.to_bits() == worst.to_bits())?;
        let (runs, failures) = (of.rows.len(), of.failures());
        let kind = catalogue.kinds.iter().find(|kind| kind.name == name);
        let found = found(&of);
        Some(OfKind {
            kind: name.to_owned(),
            worst_size: worst,
            unit: kind.map_or_else(String::new, |kind| kind.unit.clone()),
            runs,
            failures,
            failures_of_all: of.failures_of_all(),
            bound: exact_bound::of_share(failures as u64, runs as u64),
            worst_seed: of.worst()?.seed,
            worst_hmi_s: of.most(|outcome| outcome.worst_hazard_s),
            worst_hmi_m: of.most(|outcome| outcome.worst_hazard_m),
            hidden_s: of.sum(|outcome| outcome.hidden_hazardous) as f64 * STEP,
            error_over_pl_max: error_over_level(&of),
            share_claimed: of.share_claimed(),
            class: match kind {
                Some(kind) if kind.revealed.is_some() => Class::C,
                _ if found.is_empty() => Class::A,
                _ => Class::B,
            },
            found: found.len(),
            found_s: found.iter().map(|found| 1e-3 * found.after_ms as f64).fold(0.0, f64::max),
            found_m: found.iter().map(|found| 1e-3 * found.after_mm as f64).fold(0.0, f64::max),
            found_by: most_often(found.iter().map(|found| found.by.as_str())),
            sizes: by_size(swept, name).iter().map(Swept::of).collect(),
        })
    };
    let mut kinds: Vec<OfKind> = names.into_iter().filter_map(of_kind).collect();
    kinds.sort_by(|a, b| {
        let share = |of: &OfKind| of.failures as f64 / of.runs.max(1) as f64;
        let over = |of: &OfKind| of.error_over_pl_max.unwrap_or(0.0);
        let by_hazard = share(b).total_cmp(&share(a)).then(b.worst_hmi_s.total_cmp(&a.worst_hmi_s));
        by_hazard.then(over(b).total_cmp(&over(a)))
    });
    kinds
}

fn found<'a>(of: &OfSize<'a>) -> Vec<&'a Found> {
    of.rows.iter().filter_map(|row| row.outcome.as_ref()?.found.as_ref()).collect()
}

fn most_often<'a>(words: impl Iterator<Item = &'a str>) -> String {
    let mut counts = BTreeMap::<&str, usize>::new();
    for word in words {
        *counts.entry(word).or_default() += 1;
    }
    counts.into_iter().max_by_key(|(_, count)| *count).map_or_else(String::new, |(word, _)| word.to_owned())
}
