//! How near surfaces are, in two bits for each cell of a square: what the search looks up.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::geometry::ScanPoint;

/// Size of a cell, m.
pub const CELL: f32 = 0.1;

/// Cells along a side.
pub const SIDE: usize = 320;

/// Half of the side, m.
pub const HALF: f32 = 0.5 * SIDE as f32 * CELL;

/// Bytes.
const BYTES: usize = SIDE * SIDE / 4;

/// Cells near which nothing is.
const NOTHING: [u8; 1024] = [0; 1024];

/// Cells around that of a point, and their least value: three times the density of a Gaussian of 12 cm at the distance of their centres, rounded.
const STAMP: [[u8; 5]; 5] = [[0, 1, 1, 1, 0], [1, 1, 2, 1, 1], [1, 2, 3, 2, 1], [1, 1, 2, 1, 1], [0, 1, 1, 1, 0]];

/// A grid around the origin of its frame.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LikelihoodGrid {
    /// Nothing before the grid is cleared for the first time: what would be built here would be built on the stack.
    cells: Vec<u8, BYTES>,
}

impl LikelihoodGrid {
    /// Nothing is near; it is to be cleared before something is added.
    #[must_use]
    #[inline(always)]
    pub const fn new() -> Self {
        Self { cells: Vec::new() }
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.cells.fill(0);
        // Once, by pieces: to add one cell after the other takes ten times as long.
        while let Some(rest) = BYTES.checked_sub(self.cells.len())
            && rest > 0
        {
            let piece = NOTHING.get(..rest.min(NOTHING.len())).unwrap_or_default();
            if self.cells.extend_from_slice(piece).is_err() {
                break;
            }
        }
    }

    /// Column and row of a point, m; outside of the grid they are negative or too large.
    #[must_use]
    pub fn cell(point: &ScanPoint) -> (i32, i32) {
        let index = |length: f32| libm::floorf((length + HALF) * (1.0 / CELL)) as i32;
        (index(point.x), index(point.y))
    }

    /// From 0 (nothing is near) to 3. Zero outside.
    #[must_use]
    pub fn value(&self, column: i32, row: i32) -> u8 {
        if !Self::is_within(column, row, 0) {
            return 0;
        }
        let index = row as usize * SIDE + column as usize;
        self.cells.get(index >> 2).map_or(0, |cells| (cells >> ((index & 3) << 1)) & 3)
    }

    /// Whether a cell is so far within the grid, in cells, or, if that is negative, no further beside it.
    fn is_within(column: i32, row: i32, margin: i32) -> bool {
        let cells = margin..SIDE as i32 - margin;
        cells.contains(&column) && cells.contains(&row)
    }

    /// Whether a cell may come into the grid when it is shifted by at most so many cells along each axis.
    pub(super) fn can_enter(column: i32, row: i32, most: i32) -> bool {
        Self::is_within(column, row, -most)
    }

    /// The number of a cell; None if it is not in the grid, or may leave it when it is shifted by at most so many cells along each axis.
    pub(super) fn number_within(column: i32, row: i32, most: i32) -> Option<u32> {
        Self::is_within(column, row, most).then_some((row * SIDE as i32 + column) as u32)
    }

    /// By how much the number changes of a cell that is shifted by so many columns and rows.
    pub(super) const fn numbers_between(columns: i32, rows: i32) -> i32 {
        rows * SIDE as i32 + columns
    }

    /// Sum of the values of cells by their numbers, each of them changed by so much.
    pub(super) fn sum_of(&self, numbers: &[u32], shift: i32) -> u32 {
        let cells = self.cells.as_slice();
        numbers.iter().fold(0, |sum, number| {
            let number = number.wrapping_add_signed(shift);
            let values = cells.get(number as usize >> 2).map_or(0, |values| u32::from(*values));
            // No sum of so few values is that large.
            sum.wrapping_add((values >> ((number & 3) << 1)) & 3)
        })
    }

    /// Adds a point, m.
    pub fn add(&mut self, point: &ScanPoint) {
        let (column, row) = Self::cell(point);
        if self.value(column, row) == 3 {
            return;
        }
        for (y, values) in (-2..).zip(STAMP) {
            for (x, value) in (-2..).zip(values) {
                self.raise(column as isize + x, row as isize + y, value);
            }
        }
    }

    fn raise(&mut self, column: isize, row: isize, value: u8) {
        if !(0..SIDE as isize).contains(&column) || !(0..SIDE as isize).contains(&row) {
            return;
        }
        let index = row as usize * SIDE + column as usize;
        let shift = (index & 3) << 1;
        if let Some(cells) = self.cells.get_mut(index >> 2)
            && (*cells >> shift) & 3 < value
        {
            *cells = (*cells & !(3 << shift)) | (value << shift);
        }
    }
}

impl Default for LikelihoodGrid {
    fn default() -> Self {
        Self::new()
    }
}
