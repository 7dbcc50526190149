//! Which points are near.

use heapless::Vec;

use crate::geometry::Point;

/// A search goes over at most this many rows and columns of cells on either side.
const REACH: i64 = 4;

/// Points sorted by the cell of a square grid in which they lie: a bounded spatial index over up to `POINTS` points.
#[derive(Clone, Debug)]
pub struct Grid<const POINTS: usize> {
    cell: f64,
    /// Row, column and number of each point, in that order.
    places: Vec<(i16, i16, u16), POINTS>,
}

impl<const POINTS: usize> Grid<POINTS> {
    /// An empty index with cells of `cell` metres.
    #[must_use]
    pub const fn new(cell: f64) -> Self {
        Self { cell, places: Vec::new() }
    }

    /// Sorts the points, m, into cells. Points beyond the capacity are left out.
    pub fn build(&mut self, points: impl Iterator<Item = Point>) {
        self.places.clear();
        for (number, point) in points.take(POINTS.min(usize::from(u16::MAX))).enumerate() {
            let _ = self.places.push((self.line(point.y), self.line(point.x), number as u16));
        }
        self.places.sort_unstable();
    }

    /// Numbers of the points in the cells that a square of half width `radius` (m) around `point` touches: all points
    /// within `radius`, and some that are not. The radius counts as at most four cells.
    pub fn near(&self, point: Point, radius: f64) -> impl Iterator<Item = usize> {
        let radius = radius.min(self.cell * (REACH - 1) as f64);
        let rows = (self.line(point.y - radius), self.line(point.y + radius));
        let columns = (self.line(point.x - radius), self.line(point.x + radius));
        (0..2 * REACH as i16).map_while(move |offset| rows.0.checked_add(offset).filter(|row| *row <= rows.1)).flat_map(
            move |row| {
                let first = self.places.partition_point(|place| (place.0, place.1) < (row, columns.0));
                self.places
                    .get(first..)
                    .unwrap_or_default()
                    .iter()
                    .take_while(move |place| place.0 == row && place.1 <= columns.1)
                    .map(|place| usize::from(place.2))
            },
        )
    }

    /// The row or column of a coordinate, m. What lies further away than 32767 cells is all in the last one.
    fn line(&self, coordinate: f64) -> i16 {
        let place = coordinate / self.cell;
        let towards_zero = place as i32;
        // Rounding down by hand costs a tenth of the general function.
        let down = if f64::from(towards_zero) > place { towards_zero.saturating_sub(1) } else { towards_zero };
        down.clamp(i32::from(i16::MIN), i32::from(i16::MAX)) as i16
    }
}
