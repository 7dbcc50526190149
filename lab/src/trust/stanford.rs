//! Stanford diagram: errors against protection levels.

use std::collections::BTreeMap;

use serde::Serialize;

use super::row::Row;

/// Width of a cell, mm.
const CELL_MM: f64 = 5.0;
/// Cells along each axis.
pub const CELLS: u32 = 81;

/// How many claims are in each cell: level times [`CELLS`] plus error.
pub type Counts = BTreeMap<u32, u64>;

/// Counts a claim with this protection level and error of the position, m.
pub fn count(counts: &mut Counts, level: f64, error: f64) {
    let cell = |value: f64| (1e3 * value / CELL_MM).clamp(0.0, f64::from(CELLS - 1)) as u32;
    *counts.entry(CELLS * cell(level) + cell(error)).or_default() += 1;
}

/// Claims with their errors and protection levels of the position.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Stanford {
    /// Width of a cell, mm.
    pub cell_mm: f64,
    /// Cells with claims: level, error, and how many; the last cell of each axis has all that is larger.
    pub cells: Vec<(u32, u32, u64)>,
}

impl Stanford {
    /// Of claims that were counted.
    #[must_use]
    pub fn of(counts: Counts) -> Self {
        let cells = counts.into_iter().map(|(cell, count)| (cell / CELLS, cell % CELLS, count)).collect();
        Self { cell_mm: CELL_MM, cells }
    }

    /// The claims of these rows.
    pub(super) fn of_rows(rows: &[&Row]) -> Self {
        let mut counts = Counts::new();
        for (cell, count) in rows.iter().filter_map(|row| row.outcome.as_ref()).flat_map(|outcome| &outcome.stanford) {
            *counts.entry(*cell).or_default() += count;
        }
        Self::of(counts)
    }
}
