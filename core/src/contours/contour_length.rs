//! The length of contour that a point of a scan stands for.

use super::SurfacePoint;
use crate::geometry::ScanPoint;

/// From a point to its neighbour, m: they lie no denser, and what is between two that are farther from each other was not seen.
const WAY: (f32, f32) = (0.05, 0.15);

/// The lengths of the points of a scan, which follow each other by their bearings.
///
/// Beams meet what is near more often than what is far: where each point counts alike, a near thing that has moved outweighs a wall.
pub(super) struct ContourLengths<'a> {
    points: &'a [SurfacePoint],
    /// A point, and the way to it from the one before, m.
    known: (usize, f32),
}

impl<'a> ContourLengths<'a> {
    pub(super) const fn new(points: &'a [SurfacePoint]) -> Self {
        Self { points, known: (0, WAY.1) }
    }

    /// Half of the ways from the point with that index to those before and behind it, m. One at the end stands for as much as can be seen.
    pub(super) fn at(&mut self, index: usize) -> f32 {
        let before = if self.known.0 == index { self.known.1 } else { self.way_to(index) };
        let behind = self.way_to(index + 1);
        self.known = (index + 1, behind);
        0.5 * (before + behind)
    }

    /// From the point before the one with that index, m.
    fn way_to(&self, index: usize) -> f32 {
        let before = index.checked_sub(1).and_then(|before| self.points.get(before));
        let way = before.zip(self.points.get(index)).map(|(before, here)| distance(&(here.position - before.position)));
        way.map_or(WAY.1, |way| way.clamp(WAY.0, WAY.1))
    }
}

/// The length of a vector within 4 %, without a square root: alpha max plus beta min.
fn distance(way: &ScanPoint) -> f32 {
    let (x, y) = (libm::fabsf(way.x), libm::fabsf(way.y));
    0.960_434 * x.max(y) + 0.397_825 * x.min(y)
}
