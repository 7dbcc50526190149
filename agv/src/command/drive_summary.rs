//! What there is to say about a replayed log, as JSON.

use agv_core::record::Damage;
use agv_host_sim::drive::{Figures, Grade};
use agv_host_sim::replay::Comparisons;
use serde::Serialize;

/// What there is to say about a replayed log.
#[derive(Serialize)]
pub struct DriveSummary<'a> {
    /// Program that wrote the log.
    software: &'a str,
    /// How the drive is to be seen at a glance.
    grade: Grade,
    #[serde(flatten)]
    figures: &'a Figures,
    #[serde(flatten)]
    comparisons: Comparisons,
    damage: Vec<DamageEntry>,
}

#[derive(Serialize)]
struct DamageEntry {
    offset: u64,
    skipped: u64,
    reason: String,
}

impl<'a> DriveSummary<'a> {
    /// Puts the parts together.
    pub fn new(
        software: &'a str,
        figures: &'a Figures,
        comparisons: Comparisons,
        damages: &[Damage],
    ) -> DriveSummary<'a> {
        let entry = |damage: &Damage| DamageEntry {
            offset: damage.offset,
            skipped: damage.skipped,
            reason: damage.reason.to_string(),
        };
        Self {
            software,
            grade: figures.fitness.grade(),
            figures,
            comparisons,
            damage: damages.iter().map(entry).collect(),
        }
    }
}
