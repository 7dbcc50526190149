//! The coarsest scale of a grid in bits, a plane for each direction: one look-up tells of 32 cells.

use super::place_grid::Offset;

/// Directions that a mask can have.
const PLANES: usize = 8;

/// Cells that are looked at together.
pub(super) const LANES: i32 = u32::BITS as i32;

/// Empty bytes behind each row, which are those before the next one, too: points may be as many cells beside the map.
const GAP: usize = 2;
pub(super) const MOST_BESIDE: u16 = 8 * GAP as u16;

/// Bytes that a look-up takes.
const WINDOW: usize = 8;

/// Bits of the number of misses.
const DIGITS: usize = 6;

/// Most points that can be counted.
pub(super) const MOST_POINTS: usize = (1 << DIGITS) - 1;

/// Where they are among the bytes of a grid.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BitPlanes {
    columns: i32,
    rows: i32,
}

impl BitPlanes {
    pub(super) fn new(columns: i32, rows: i32) -> Self {
        Self { columns: columns.max(0), rows: rows.max(0) }
    }

    fn stride(self) -> usize {
        (self.columns as usize).div_ceil(8) + GAP
    }

    /// Bytes that they take.
    pub(super) fn bytes(self) -> usize {
        (PLANES * self.rows as usize).saturating_mul(self.stride()).saturating_add(GAP + WINDOW)
    }

    /// Where a row of a plane begins.
    fn row(self, plane: usize, row: i32) -> usize {
        GAP + (plane * self.rows as usize + row as usize) * self.stride()
    }

    /// Marks a cell within the map in the planes of a mask.
    pub(super) fn mark(self, bytes: &mut [u8], (column, row): (i32, i32), mask: u8) {
        for plane in (0..PLANES).filter(|plane| mask & (1 << plane) != 0) {
            if let Some(byte) = bytes.get_mut(self.row(plane, row) + column as usize / 8) {
                *byte |= 1 << (column % 8);
            }
        }
    }

    /// Groups of cells: each row's, one behind the other.
    pub(super) fn groups(self) -> i32 {
        self.groups_a_row() * self.rows
    }

    fn groups_a_row(self) -> i32 {
        (self.columns as u32).div_ceil(LANES as u32) as i32
    }

    /// Column and row of the first cell of a group.
    pub(super) fn first_of(self, group: i32) -> Option<(i32, i32)> {
        let row = group.checked_div(self.groups_a_row())?;
        Some(((group - row * self.groups_a_row()) * LANES, row))
    }

    /// At which cells of a group the laser may be so that at least `needed` of the points, at most [`MOST_POINTS`], lie on surfaces: a bit
    /// each. Behind it the number of points that were looked up.
    pub(super) fn fitting(self, bytes: &[u8], offsets: &[Offset], group: i32, needed: usize) -> (u32, u32) {
        let Some((column, row)) = self.first_of(group) else { return (0, 0) };
        let within = (self.columns - column).clamp(0, LANES) as u32;
        let mut refused = u32::MAX.checked_shl(within).unwrap_or(0);
        // Counts up to a number of misses that is one too many, where it overflows.
        let begin = MOST_POINTS.saturating_sub(offsets.len().saturating_sub(needed));
        let mut digits: [u32; DIGITS] =
            core::array::from_fn(|digit| if begin & (1 << digit) == 0 { 0 } else { u32::MAX });
        let mut looked_up = 0;
        for offset in offsets {
            looked_up += 1;
            let mut carry = !self.hits(bytes, offset, column, row);
            for digit in &mut digits {
                let sum = *digit ^ carry;
                carry &= *digit;
                *digit = sum;
            }
            refused |= carry;
            if refused == u32::MAX {
                break;
            }
        }
        (!refused, looked_up)
    }

    /// At which cells from that one on a point hits: a bit each.
    fn hits(self, bytes: &[u8], offset: &Offset, column: i32, row: i32) -> u32 {
        let (plane, row) = (offset.facing.trailing_zeros() as usize, row + i32::from(offset.row));
        if plane >= PLANES || !(0..self.rows).contains(&row) || offset.column.unsigned_abs() > MOST_BESIDE {
            return 0;
        }
        let column = column + i32::from(offset.column);
        let first = self.row(plane, row).wrapping_add_signed(column.div_euclid(8) as isize);
        let window = bytes.get(first..).and_then(|bytes| bytes.first_chunk::<WINDOW>());
        window.map_or(0, |window| (u64::from_le_bytes(*window) >> column.rem_euclid(8)) as u32)
    }
}
