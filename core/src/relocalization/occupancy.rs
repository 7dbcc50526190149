//! Where there is a reflector near, as bits.

use crate::geometry::ScanPoint;

/// Smallest edge of a cell, m.
const SMALLEST_CELL: f32 = 0.25;

/// The cells of a bitmap.
#[derive(Clone, Copy, Debug)]
struct Area {
    corner: ScanPoint,
    per_metre: f32,
    columns: u32,
    rows: u32,
}

/// A bitmap over the area of the map; a set bit says that a reflector may be within the reach of a point in the cell.
#[derive(Clone, Debug)]
pub(super) struct Occupancy<const WORDS: usize> {
    area: Area,
    bits: [u32; WORDS],
}

impl<const WORDS: usize> Occupancy<WORDS> {
    pub(super) const fn new() -> Self {
        let area = Area { corner: ScanPoint::new(0.0, 0.0), per_metre: 1.0, columns: 0, rows: 0 };
        Self { area, bits: [0; WORDS] }
    }

    /// Marks what lies within `reach` (m) of the points.
    pub(super) fn build(&mut self, points: impl Iterator<Item = ScanPoint> + Clone, reach: f32) {
        self.bits.fill(0);
        (self.area.columns, self.area.rows) = (0, 0);
        let Some(first) = points.clone().next() else { return };
        let (mut low, mut high) = (first, first);
        for point in points.clone() {
            low = low.inf(&point);
            high = high.sup(&point);
        }
        let margin = ScanPoint::repeat(2.0 * reach);
        let size = high - low + 2.0 * margin;
        let room = (WORDS * 32) as f32;
        // Rounding up both sides costs a row and a column.
        let cell = (libm::sqrtf(size.x * size.y / room) * 1.02 + size.max() / room).max(SMALLEST_CELL);
        let (corner, per_metre) = (low - margin, 1.0 / cell);
        let columns = (size.x * per_metre) as u32 + 1;
        self.area = Area { corner, per_metre, columns, rows: (size.y * per_metre) as u32 + 1 };
        for point in points {
            let from = (point - corner - ScanPoint::repeat(reach)) * per_metre;
            let to = (point - corner + ScanPoint::repeat(reach)) * per_metre;
            for row in from.y as u32..=(to.y as u32).min(from.y as u32 + MOST_ROWS) {
                for column in from.x as u32..=(to.x as u32).min(from.x as u32 + MOST_ROWS) {
                    let bit = (row * columns + column) as usize;
                    if let Some(word) = self.bits.get_mut(bit / 32) {
                        *word |= 1 << (bit % 32);
                    }
                }
            }
        }
    }

    /// The bitmap without its capacity.
    pub(super) fn view(&self) -> OccupancyView<'_> {
        OccupancyView { area: self.area, bits: &self.bits }
    }
}

/// An [`Occupancy`] of any capacity.
#[derive(Clone, Copy, Debug)]
pub(super) struct OccupancyView<'a> {
    area: Area,
    bits: &'a [u32],
}

impl OccupancyView<'_> {
    /// Whether there may be a reflector within reach.
    #[inline]
    pub(super) fn is_near(&self, point: ScanPoint) -> bool {
        let area = &self.area;
        let place = (point - area.corner) * area.per_metre;
        if !(place.x >= 0.0 && place.y >= 0.0) {
            return false;
        }
        let (column, row) = (place.x as u32, place.y as u32);
        if column >= area.columns || row >= area.rows {
            return false;
        }
        let bit = (row * area.columns + column) as usize;
        self.bits.get(bit / 32).is_some_and(|word| word >> (bit % 32) & 1 == 1)
    }
}

/// Most rows or columns that one reflector marks.
const MOST_ROWS: u32 = 16;
