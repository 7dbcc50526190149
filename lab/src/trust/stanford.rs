//! Stanford diagram: errors against protection levels.

use std::collections::BTreeMap;

use serde::Serialize;

use super::outcome::{CELL_MM, CELLS};
use super::row::Row;

/// Claims with their errors and protection levels of the position.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Stanford {
    /// Width of a cell, mm.
    pub cell_mm: f64,
    /// Cells with claims: level, error, and how many; the last cell of each axis has all that is larger.
    pub cells: Vec<(u32, u32, u64)>,
}

/// The claims of these rows.
pub(super) fn stanford(rows: &[&Row]) -> Stanford {
    let mut counts = BTreeMap::<u32, u64>::new();
    for (cell, count) in rows.iter().filter_map(|row| row.outcome.as_ref()).flat_map(|outcome| &outcome.stanford) {
        *counts.entry(*cell).or_default() += count;
    }
    of_counts(counts)
}

/// Of claims that were counted as [`super::outcome::Outcome::stanford`] has them.
pub(super) fn of_counts(counts: BTreeMap<u32, u64>) -> Stanford {
    let cells = counts.into_iter().map(|(cell, count)| (cell / CELLS, cell % CELLS, count)).collect();
    Stanford { cell_mm: CELL_MM, cells }
}
