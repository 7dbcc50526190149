//! The figures of a campaign.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use super::exact_bound;
use super::kinds::{Catalogue, NOTHING};
use super::of_kind::{Class, OfKind, per_fault};
use super::of_pairs::{OfPairs, pairs};
use super::outcome::Outcome;
use super::row::{OfSize, Row, share};
use super::stanford::Stanford;
use super::worst::{WorstValues, seconds_to_first_claim, worst_values};
use agv_host_sim::accuracy::Spread;

/// The figures of a campaign; shares of nothing are none.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figures {
    /// Runs.
    pub runs: usize,
    /// Runs that panicked.
    pub panics: usize,
    /// Share of the runs with a misleading output.
    pub mi_share: f64,
    /// Events of hazardous outputs.
    pub hmi_events: u64,
    /// Longest time in hazardous outputs of one event, s.
    pub worst_hmi_s: f64,
    /// Longest distance in hazardous outputs of one event, m.
    pub worst_hmi_m: f64,
    /// Events that are integrity failures.
    pub integrity_failures: u64,
    /// Without faults, in halls that commissioning accepts: hours, and km driven.
    pub nominal_hours: f64,
    /// See [`Self::nominal_hours`].
    pub nominal_km: f64,
    /// Misleading outputs without faults, in all halls.
    pub nominal_mi: u64,
    /// Hazardous events without faults, in all halls.
    pub nominal_hmi: u64,
    /// Share of the halls that commissioning refuses, of runs without faults; none if there was none.
    pub refused_halls: Option<f64>,
    /// Share of the time in which the pose was available for travelling.
    pub availability_travel: Option<f64>,
    /// Share of the time at stations in which it was available for docking.
    pub availability_docking: Option<f64>,
    /// The same over all of the time.
    pub availability_docking_of_all: Option<f64>,
    /// Losses of availability for 100 km.
    pub continuity_per_100km: Option<f64>,
    /// How often each check has said that something is wrong without faults, in halls that commissioning accepts.
    pub false_alarms: BTreeMap<String, u64>,
    /// Of the runs of which a recovery may be asked for, those that recovered.
    pub recovered_share: Option<f64>,
    /// The same share of all runs.
    pub recovered_share_of_all: f64,
    /// Protection level of the position without faults, with enough in sight, at the 95 % mark, mm.
    pub pl_nominal_mm: Option<f64>,
    /// The same of the heading, deg.
    pub pl_nominal_deg: Option<f64>,
    /// Largest share of error over protection level without faults.
    pub error_over_pl_max: f64,
    /// Time to the first claim without faults: 95 % mark and worst, s.
    pub first_claim_s: [f64; 2],
    /// The worst values, and whose they are.
    pub worst: WorstValues,
    /// What may be true, though it was not seen.
    pub bounds: Bounds,
    /// First and last seed.
    pub seeds: [u64; 2],
    /// Kinds of class C.
    pub class_c: Vec<String>,
    /// Each kind at its worst size, worst first.
    pub per_fault: Vec<OfKind>,
    /// Pairs of faults.
    pub pairs: OfPairs,
    /// Pairs of which one takes away every source that could show the other; in none of the figures above.
    pub pairs_apart: OfPairs,
    /// Without faults.
    pub stanford_nominal: Stanford,
    /// With faults, but for pairs apart.
    pub stanford_faults: Stanford,
}

/// Exact 95 % bounds, from above; of nothing there are none.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Bounds {
    /// Of the share of runs with one fault that fail; it means what it says where all scenes are distinct.
    pub failures_of_singles: Option<f64>,
    /// Share of the scenes of these runs that are distinct.
    pub distinct_scenes: Option<f64>,
    /// Of the share of runs without faults with a misleading output.
    pub nominal_mi: Option<f64>,
    /// Of the share of runs without faults with a hazardous output.
    pub nominal_hmi: Option<f64>,
    /// Of the losses of availability for 100 km.
    pub losses_per_100km: Option<f64>,
    /// Of the false alarms for 100 km.
    pub false_alarms_per_100km: Option<f64>,
}

/// The figures of these rows, and of those of the sweep by which the worst sizes were found, if they are known.
#[must_use]
pub fn figures(every_row: &[Row], swept: &[Row], catalogue: &Catalogue) -> Figures {
    let hidden = |row: &Row| {
        let (kind, size) = row.with.as_ref()?;
        catalogue.hidden_by((&row.kind, row.size), (kind, *size)).map(str::to_owned)
    };
    let (apart, rows): (Vec<&Row>, Vec<&Row>) = every_row.iter().partition(|row| hidden(row).is_some());
    let of_pairs = |rows: &[&Row]| pairs(rows.iter().copied().filter(|row| row.with.is_some()), hidden);
    let (pairs, pairs_apart) = (of_pairs(&rows), of_pairs(&apart));
    let (sound, faulty): (Vec<&Row>, Vec<&Row>) = rows.iter().copied().partition(|row| row.kind == NOTHING);
    let sound = OfSize { size: 0.0, rows: sound };
    let all = OfSize { size: 0.0, rows: rows.clone() };
    let accepted = OfSize { size: 0.0, rows: sound.rows.iter().copied().filter(|row| row.is_accepted).collect() };
    let km = accepted.sum(|outcome| outcome.driven_um) as f64 * 1e-9;
    let recovering = OfSize { size: 0.0, rows: rows.iter().copied().filter(|row| row.can_recover).collect() };
    let first_claims = first_claims(&sound);
    let seeds = rows.iter().map(|row| row.seed);
    let of_kinds = per_fault(&rows, swept, catalogue);
    let per_100km = |count: f64| (km > 0.0).then(|| count / km * 100.0);
    let losses = accepted.sum(|outcome| u64::from(outcome.losses));
    let false_alarms = false_alarms(&accepted);
    let singles = OfSize { size: 0.0, rows: faulty.iter().copied().filter(|row| row.with.is_none()).collect() };
    let scenes: BTreeSet<u64> = singles.rows.iter().map(|row| row.scene).collect();
    let sound_runs = sound.rows.len() as u64;
    Figures {
        runs: rows.len(),
        panics: rows.iter().filter(|row| row.outcome.is_none()).count(),
        mi_share: all.count(|outcome| outcome.misleading > 0) as f64 / rows.len().max(1) as f64,
        hmi_events: all.sum(|outcome| u64::from(outcome.hazards)),
        worst_hmi_s: all.most(|outcome| outcome.worst_hazard_s),
        worst_hmi_m: all.most(|outcome| outcome.worst_hazard_m),
        integrity_failures: all.sum(|outcome| u64::from(outcome.failures)),
        nominal_hours: accepted.sum(|outcome| outcome.outputs) as f64 * super::judge::STEP / 3600.0,
        nominal_km: km,
        nominal_mi: sound.sum(|outcome| outcome.misleading),
        nominal_hmi: sound.sum(|outcome| u64::from(outcome.hazards)),
        refused_halls: share((sound.rows.len() - accepted.rows.len()) as u64, sound.rows.len() as u64),
        availability_travel: share(accepted.sum(|outcome| outcome.available), accepted.sum(|outcome| outcome.judged)),
        availability_docking: share(
            accepted.sum(|outcome| outcome.docking_available),
            accepted.sum(|outcome| outcome.docking),
        ),
        availability_docking_of_all: share(
            accepted.sum(|outcome| outcome.within_docking),
            accepted.sum(|outcome| outcome.judged),
        ),
        continuity_per_100km: per_100km(losses as f64),
        recovered_share: share(recovering.count(|outcome| outcome.ends_right), recovering.rows.len() as u64),
        recovered_share_of_all: all.count(|outcome| outcome.ends_right) as f64 / rows.len().max(1) as f64,
        pl_nominal_mm: mark(&accepted, |outcome| &outcome.nominal_mm),
        pl_nominal_deg: mark(&accepted, |outcome| &outcome.nominal_cdeg).map(|hundredths| 0.01 * hundredths),
        error_over_pl_max: sound.most(|outcome| outcome.most_over_level),
        first_claim_s: [first_claims.p95, first_claims.max],
        worst: worst_values(&all, &sound, &accepted),
        bounds: Bounds {
            failures_of_singles: exact_bound::of_share(singles.failures() as u64, singles.rows.len() as u64),
            distinct_scenes: share(scenes.len() as u64, singles.rows.len() as u64),
            nominal_mi: exact_bound::of_share(sound.count(|outcome| outcome.misleading > 0), sound_runs),
            nominal_hmi: exact_bound::of_share(sound.count(|outcome| outcome.hazards > 0), sound_runs),
            losses_per_100km: per_100km(exact_bound::of_count(losses)),
            false_alarms_per_100km: per_100km(exact_bound::of_count(false_alarms.values().sum())),
        },
        false_alarms,
        seeds: [seeds.clone().min().unwrap_or_default(), seeds.max().unwrap_or_default()],
        class_c: of_kinds.iter().filter(|of| of.class == Class::C).map(|of| of.kind.clone()).collect(),
        per_fault: of_kinds,
        pairs,
        pairs_apart,
        stanford_nominal: Stanford::of_rows(&sound.rows),
        stanford_faults: Stanford::of_rows(&faulty),
    }
}

/// The 95 % mark of a count of values.
fn mark(of: &OfSize, values: fn(&Outcome) -> &BTreeMap<u32, u64>) -> Option<f64> {
    let mut counts = BTreeMap::<u32, u64>::new();
    for outcome in of.rows.iter().filter_map(|row| row.outcome.as_ref()) {
        for (value, count) in values(outcome) {
            *counts.entry(*value).or_default() += count;
        }
    }
    let total: u64 = counts.values().sum();
    let mut below = 0;
    counts.into_iter().find_map(|(value, count)| {
        below += count;
        (total > 0 && below * 100 >= total * 95).then_some(f64::from(value))
    })
}

/// Times to the first claim, s.
fn first_claims(of: &OfSize) -> Spread {
    Spread::of(of.rows.iter().filter_map(|row| Some(seconds_to_first_claim(row.outcome.as_ref()?))))
}

fn false_alarms(of: &OfSize) -> BTreeMap<String, u64> {
    let mut counts = BTreeMap::new();
    for (check, count) in of.rows.iter().filter_map(|row| row.outcome.as_ref()).flat_map(|outcome| &outcome.alarms) {
        *counts.entry(check.clone()).or_default() += count;
    }
    counts
}
