//! The worst value, and the seed of its run, beside each mean and each 95 % mark.

use std::collections::BTreeMap;

use serde::Serialize;

use super::judge::STEP;
use super::outcome::Outcome;
use super::row::{OfSize, share};

/// A value, and whose it is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Worst {
    /// The value.
    pub value: f64,
    /// Seed of the run.
    pub seed: u64,
}

/// The worst values of a campaign; none where no run has such a value.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WorstValues {
    /// Longest time in hazardous outputs of one event, s, with faults and without.
    pub hmi_s: Option<Worst>,
    /// Longest distance in them, m.
    pub hmi_m: Option<Worst>,
    /// Least share of a drive without faults, of the time in which the pose was available for travelling.
    pub availability_travel: Option<Worst>,
    /// The same at stations, for docking.
    pub availability_docking: Option<Worst>,
    /// Most losses of availability of one such drive.
    pub losses: Option<Worst>,
    /// Largest protection level of the position without faults, with enough in sight, mm.
    pub pl_nominal_mm: Option<Worst>,
    /// The same of the heading, deg.
    pub pl_nominal_deg: Option<Worst>,
    /// Largest share of error over protection level without faults.
    pub error_over_pl: Option<Worst>,
    /// Longest time to the first claim without faults, s.
    pub first_claim_s: Option<Worst>,
}

/// The worst values of all runs, of those without faults, and of these in halls that commissioning accepts.
pub(super) fn worst_values(all: &OfSize, sound: &OfSize, accepted: &OfSize) -> WorstValues {
    let last = |values: &BTreeMap<u32, u64>| values.keys().next_back().map(|value| f64::from(*value));
    WorstValues {
        hmi_s: most(all, |outcome| above_nought(outcome.worst_hazard_s)),
        hmi_m: most(all, |outcome| above_nought(outcome.worst_hazard_m)),
        availability_travel: least(accepted, |outcome| share(outcome.available, outcome.judged)),
        availability_docking: least(accepted, |outcome| share(outcome.docking_available, outcome.docking)),
        losses: most(accepted, |outcome| above_nought(f64::from(outcome.losses))),
        pl_nominal_mm: most(accepted, |outcome| last(&outcome.nominal_mm)),
        pl_nominal_deg: most(accepted, |outcome| last(&outcome.nominal_cdeg).map(|hundredths| 0.01 * hundredths)),
        error_over_pl: most(sound, |outcome| above_nought(outcome.most_over_level)),
        first_claim_s: most(sound, |outcome| Some(seconds_to_first_claim(outcome))),
    }
}

/// Time to the first claim, s. A vehicle that never claims has waited for all of the run.
pub(super) fn seconds_to_first_claim(outcome: &Outcome) -> f64 {
    outcome.first_claim.unwrap_or(outcome.outputs) as f64 * STEP
}

fn above_nought(value: f64) -> Option<f64> {
    (value > 0.0).then_some(value)
}

fn values<'a>(of: &'a OfSize, value: impl Fn(&Outcome) -> Option<f64> + 'a) -> impl Iterator<Item = Worst> + 'a {
    of.rows.iter().filter_map(move |row| Some(Worst { value: value(row.outcome.as_ref()?)?, seed: row.seed }))
}

/// The greatest value; of equal ones the first.
fn most(of: &OfSize, value: impl Fn(&Outcome) -> Option<f64>) -> Option<Worst> {
    values(of, value).reduce(|most, one| if one.value > most.value { one } else { most })
}

/// The least value; of equal ones the first.
fn least(of: &OfSize, value: impl Fn(&Outcome) -> Option<f64>) -> Option<Worst> {
    values(of, value).reduce(|least, one| if one.value < least.value { one } else { least })
}
