//! Which points are near.

use heapless::Vec;

use crate::geometry::Point;
use crate::order::heap_sort;

/// A search goes over at most this many rows and columns of cells on either side.
const REACH: i64 = 4;

/// How a plane is parted into cells.
#[derive(Clone, Copy, Debug)]
struct Cells {
    /// Edge, m.
    edge: f64,
    /// A corner of the first cell: that of the map's first point, as maps may lie far from the origin of W.
    corner: Point,
}

/// Points sorted by the cell of a square grid in which they lie: a bounded spatial index over up to `POINTS` points.
#[derive(Clone, Debug)]
pub struct Grid<const POINTS: usize> {
    cells: Cells,
    /// Row, column and number of each point, in that order.
    places: Vec<(i16, i16, u16), POINTS>,
}

impl<const POINTS: usize> Grid<POINTS> {
    /// An empty index with cells of `cell` metres.
    #[must_use]
    pub const fn new(cell: f64) -> Self {
        Self { cells: Cells { edge: cell, corner: Point::new(0.0, 0.0) }, places: Vec::new() }
    }

    /// Sorts the points, m, into cells. Points beyond the capacity are left out.
    pub fn build(&mut self, points: impl Iterator<Item = Point>) {
        self.places.clear();
        for (number, point) in points.take(POINTS.min(usize::from(u16::MAX))).enumerate() {
            if number == 0 {
                self.cells.corner = point;
            }
            let (row, column) = self.cells.place(&point);
            let _ = self.places.push((row, column, number as u16));
        }
        heap_sort(&mut self.places);
    }

    /// The index without its capacity.
    #[inline]
    #[must_use]
    pub fn view(&self) -> GridView<'_> {
        GridView { cells: self.cells, places: &self.places }
    }
}

/// A [`Grid`] of any capacity.
#[derive(Clone, Copy, Debug)]
pub struct GridView<'a> {
    cells: Cells,
    places: &'a [(i16, i16, u16)],
}

impl<'a> GridView<'a> {
    /// Numbers of the points in the cells that a square of half width `radius` (m) around `point` touches: all points
    /// within `radius`, and some that are not. The radius counts as at most four cells.
    #[inline]
    pub fn near(&self, point: Point, radius: f64) -> impl Iterator<Item = usize> + use<'a> {
        let Self { cells, places } = *self;
        let radius = radius.min(cells.edge * (REACH - 1) as f64);
        let (first_row, first_column) = cells.place(&(point - Point::repeat(radius)));
        let (last_row, last_column) = cells.place(&(point + Point::repeat(radius)));
        let rows =
            (0..2 * REACH as i16).map_while(move |step| first_row.checked_add(step).filter(|row| *row <= last_row));
        rows.flat_map(move |row| {
            let first = places.partition_point(|place| (place.0, place.1) < (row, first_column));
            places
                .get(first..)
                .unwrap_or_default()
                .iter()
                .take_while(move |place| place.0 == row && place.1 <= last_column)
                .map(|place| usize::from(place.2))
        })
    }
}

impl Cells {
    /// Row and column of a point.
    #[inline]
    fn place(&self, point: &Point) -> (i16, i16) {
        let offset = (point - self.corner) / self.edge;
        (round_down(offset.y), round_down(offset.x))
    }
}

/// The whole number below, as far as there are rows and columns: by hand, at a tenth of the general function's cost.
#[inline]
fn round_down(number: f64) -> i16 {
    let towards_zero = number as i32;
    let down = if f64::from(towards_zero) > number { towards_zero.saturating_sub(1) } else { towards_zero };
    down.clamp(i32::from(i16::MIN), i32::from(i16::MAX)) as i16
}
