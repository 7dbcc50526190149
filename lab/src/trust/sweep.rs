//! All runs: every kind at every size, and the worst size of each kind again on other seeds.

use std::panic::{AssertUnwindSafe, catch_unwind};

use rayon::prelude::*;

use super::kinds::Kind;
use super::row::{Row, by_size, worst_size};
use super::trial::Trial;
use crate::campaign::{CampaignError, Shard};

/// Between the seeds of the sweep and those of the worst sizes.
pub const OTHER_SEEDS: u64 = 50_000;

/// The trials of a sweep: each kind at each size with so many seeds from the first one on.
#[must_use]
pub fn sweep(kinds: &[Kind], runs: u64, first_seed: u64) -> Vec<Trial<'_>> {
    let of_kind = |kind| {
        let of_size = move |&size: &f64| (first_seed..first_seed + runs).map(move |seed| Trial { kind, size, seed });
        kind.every_size().iter().flat_map(of_size)
    };
    kinds.iter().flat_map(of_kind).collect()
}

/// The trials of the worst size of each kind, found in the rows of a sweep, with so many seeds of their own.
#[must_use]
pub fn worst<'a>(kinds: &'a [Kind], rows: &[Row], runs: u64, first_seed: u64) -> Vec<Trial<'a>> {
    let first = first_seed + OTHER_SEEDS;
    let of_kind = |kind: &'a Kind| {
        let size = worst_size(&by_size(rows, &kind.name)).into_iter();
        size.flat_map(move |size| (first..first + runs).map(move |seed| Trial { kind, size, seed }))
    };
    kinds.iter().flat_map(of_kind).collect()
}

/// Makes those runs that are in a shard, on all cores, and returns them in order. `done` is called after each.
///
/// # Errors
/// See [`CampaignError`]. A panic is no error but a row.
pub fn run(trials: &[Trial], shard: Shard, done: impl Fn() + Sync) -> Result<Vec<Row>, CampaignError> {
    let of_shard: Vec<&Trial> =
        trials.iter().enumerate().filter(|(number, _)| shard.has(*number)).map(|(_, trial)| trial).collect();
    of_shard
        .into_par_iter()
        .map(|trial| {
            let tried = catch_unwind(AssertUnwindSafe(|| trial.run())).ok().transpose()?;
            done();
            Ok(Row {
                kind: trial.kind.name.clone(),
                size: trial.size,
                seed: trial.seed,
                is_accepted: tried.as_ref().is_some_and(|tried| tried.is_accepted),
                can_recover: tried.as_ref().is_some_and(|tried| tried.can_recover),
                outcome: tried.map(|tried| tried.outcome),
            })
        })
        .collect()
}
