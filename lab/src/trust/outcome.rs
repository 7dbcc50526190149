//! What became of one run, in counts, so that parts of a campaign add up to the same whole in any order.

use std::collections::BTreeMap;

use agv_core::integrity::ProtectionLevel;
use serde::{Deserialize, Serialize};

/// How a fault was found.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Found {
    /// Time since it began, ms.
    pub after_ms: u64,
    /// Distance driven since it began, mm.
    pub after_mm: u64,
    /// What said so on the bus.
    pub by: String,
}

/// What became of one run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Moments that were listened to, 10 ms apart.
    pub outputs: u64,
    /// Number of the moment of the first claim.
    pub first_claim: Option<u64>,
    /// Moments from the first claim on.
    pub judged: u64,
    /// Of these, with a claim and a protection level within the alert limit of travelling.
    pub available: u64,
    /// Moments from the first claim on at which the vehicle docked with enough in sight.
    pub docking: u64,
    /// Of these, with a claim and a protection level within the alert limit of docking.
    pub docking_available: u64,
    /// Moments from the first claim on with a claim and a protection level within the alert limit of docking.
    pub within_docking: u64,
    /// Ends of availability.
    pub losses: u32,
    /// Claims.
    pub claims: u64,
    /// Claims with an error above the protection level.
    pub misleading: u64,
    /// Hazardous outputs while no sensor of the vehicle could tell the fault; they are in none of the events.
    pub hidden_hazardous: u64,
    /// Events of hazardous outputs, by either alert limit.
    pub hazards: u32,
    /// Longest time in hazardous outputs of one event, s.
    pub worst_hazard_s: f64,
    /// Longest distance in hazardous outputs of one event, m.
    pub worst_hazard_m: f64,
    /// Events that are integrity failures.
    pub failures: u32,
    /// The same if outputs that are hazardous while no sensor of the vehicle can tell the fault count like all others.
    pub failures_of_all: u32,
    /// Largest share of error over protection level of a claim.
    pub most_over_level: f64,
    /// Distance driven, um.
    pub driven_um: u64,
    /// Protection levels of the position, mm, rounded up, of claims with enough in sight: see [`super::judge::Moment`].
    pub nominal_mm: BTreeMap<u32, u64>,
    /// The same of the heading, hundredths of a degree.
    pub nominal_cdeg: BTreeMap<u32, u64>,
    /// How many claims had a protection level and an error of the position in which cells of [`CELL_MM`], as
    /// `CELLS * level + error`; the last cell of each has all that is larger.
    pub stanford: BTreeMap<u32, u64>,
    /// How often each check has begun to say that something is wrong, from the first claim on.
    pub alarms: BTreeMap<String, u64>,
    /// How the fault was found; none if it was not.
    pub found: Option<Found>,
    /// Whether the last 5 s are claims with the error within the protection level, and that within the alert limit.
    pub ends_right: bool,
}

impl Outcome {
    /// Counts a protection level with enough in sight.
    pub(super) fn add_nominal(&mut self, level: &ProtectionLevel) {
        let cell = |value: f64| value.ceil().clamp(0.0, f64::from(u32::MAX)) as u32;
        *self.nominal_mm.entry(cell(1e3 * level.position - 1e-6)).or_default() += 1;
        *self.nominal_cdeg.entry(cell(100.0 * level.heading.to_degrees() - 1e-6)).or_default() += 1;
    }
}
