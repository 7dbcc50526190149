//! The length of contour that a point of a scan stands for.

use super::SurfacePoint;
use crate::geometry::ScanPoint;

/// From a point to its neighbour, m: they lie no denser, and what is between two that are farther from each other was not seen.
const WAY: (f32, f32) = (0.05, 0.15);

/// Half of the ways from the point with that index to those before and behind it, m. One at the end stands for as much as can be seen.
///
/// Beams meet what is near more often than what is far: where each point counts alike, a near thing that has moved outweighs a wall.
pub(super) fn contour_length(points: &[SurfacePoint], index: usize) -> f32 {
    let here = points.get(index);
    let way_to = |other: Option<&SurfacePoint>| {
        let way = here.zip(other).map(|(here, other)| distance(&(other.position - here.position)));
        way.map_or(WAY.1, |way| way.clamp(WAY.0, WAY.1))
    };
    0.5 * (way_to(index.checked_sub(1).and_then(|before| points.get(before))) + way_to(points.get(index + 1)))
}

/// The length of a vector within 4 %, without a square root: alpha max plus beta min.
fn distance(way: &ScanPoint) -> f32 {
    let (x, y) = (libm::fabsf(way.x), libm::fabsf(way.y));
    0.960_434 * x.max(y) + 0.397_825 * x.min(y)
}
