//! All runs: every kind at every size, and the worst size of each kind again on other seeds.

use std::panic::{AssertUnwindSafe, catch_unwind};

use rayon::prelude::*;

use agv_host_sim::simulate::random::{Random, Stream};

use super::judge::Moment;
use super::kinds::Kind;
use super::pair;
use super::row::{Row, by_size, worst_size};
use super::trial::{Tested, Trial};
use crate::campaign::{CampaignError, Shard};

/// Between the seeds of the sweep and those of the worst sizes.
pub const OTHER_SEEDS: u64 = 50_000;
/// Between the seeds of the sweep and those of the pairs.
pub const PAIR_SEEDS: u64 = 75_000;
/// Seeds of a spot check: so many from the first one on.
const SAMPLED_SEEDS: u64 = 1_000_000;
const SAMPLED: usize = 1_000_000_000;

/// The trials of a sweep: each kind at each size with so many seeds from the first one on.
#[must_use]
pub fn sweep(kinds: &[Kind], runs: u64, first_seed: u64) -> Vec<Trial<'_>> {
    let of_kind = |kind| {
        let of_size =
            move |&size: &f64| (first_seed..first_seed + runs).map(move |seed| Trial::new((kind, size), None, seed));
        kind.every_size().iter().flat_map(of_size)
    };
    kinds.iter().flat_map(of_kind).collect()
}

/// Trials with two kinds each, drawn by seeds from the first one on.
#[must_use]
pub fn pairs(kinds: &[Kind], runs: u64, first_seed: u64) -> Vec<Trial<'_>> {
    let first = first_seed + PAIR_SEEDS;
    let of_seed = |seed| pair::draw(kinds, seed).map(|[one, with]| Trial::new(one, Some(with), seed));
    (first..first + runs).filter_map(of_seed).collect()
}

/// A spot check: so many trials of kinds, sizes and halls that the seed draws.
#[must_use]
pub fn sample(kinds: &[Kind], runs: u64, seed: u64) -> Vec<Trial<'_>> {
    let mut random = Random::new(seed, Stream::Pairs);
    let mut drawn = |count: usize| ((random.uniform() * count as f64) as usize).min(count.saturating_sub(1));
    let mut trial = |_| {
        let kind = kinds.get(drawn(kinds.len()))?;
        let size = *kind.every_size().get(drawn(kind.every_size().len()))?;
        Some(Trial::new((kind, size), None, SAMPLED_SEEDS + drawn(SAMPLED) as u64))
    };
    (0..runs).filter_map(&mut trial).collect()
}

/// The trials of the worst size of each kind, found in the rows of a sweep, with so many seeds of their own.
#[must_use]
pub fn worst<'a>(kinds: &'a [Kind], rows: &[Row], runs: u64, first_seed: u64) -> Vec<Trial<'a>> {
    let first = first_seed + OTHER_SEEDS;
    let of_kind = |kind: &'a Kind| {
        let size = worst_size(&by_size(rows, &kind.name)).into_iter();
        size.flat_map(move |size| (first..first + runs).map(move |seed| Trial::new((kind, size), None, seed)))
    };
    kinds.iter().flat_map(of_kind).collect()
}

/// Makes those runs that are in a shard, on all cores, and returns them in order. `done` is called after each run.
///
/// # Errors
/// See [`CampaignError`]. A panic is no error but a row.
pub fn run(trials: &[Trial], shard: Shard, tested: &Tested, done: impl Fn() + Sync) -> Result<Vec<Row>, CampaignError> {
    let of_shard: Vec<&Trial> =
        trials.iter().enumerate().filter(|(number, _)| shard.has(*number)).map(|(_, trial)| trial).collect();
    of_shard
        .into_par_iter()
        .map(|trial| {
            let row = row(trial, tested, |_| {})?;
            done();
            Ok(row)
        })
        .collect()
}

/// Makes one run, and tells each moment that is judged.
///
/// # Errors
/// See [`CampaignError`]. A panic is no error but a row.
pub fn row(trial: &Trial, tested: &Tested, tell: impl FnMut(&Moment)) -> Result<Row, CampaignError> {
    let tried = catch_unwind(AssertUnwindSafe(|| trial.run_heard(tested, tell))).ok().transpose()?;
    Ok(Row {
        kind: trial.kind.name.clone(),
        size: trial.size,
        with: trial.with.map(|(kind, size)| (kind.name.clone(), size)),
        seed: trial.seed,
        scene: trial.scene,
        is_accepted: tried.as_ref().is_some_and(|tried| tried.is_accepted),
        can_recover: tried.as_ref().is_some_and(|tried| tried.can_recover),
        outcome: tried.map(|tried| tried.outcome),
    })
}
