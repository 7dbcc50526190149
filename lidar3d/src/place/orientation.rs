//! How far the sensor has turned between two visits of a place (M 5.3).

use crate::cloud::Cloud;

/// Directions of an orientation signature.
pub const DIRECTIONS: usize = 360;

/// Mean distance in each direction, m; 0 where nothing was seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orientation(pub [f32; DIRECTIONS]);

impl Orientation {
    /// From one ring, out to `far` m (M: 50).
    #[must_use]
    pub fn of_ring(cloud: &Cloud<'_>, ring: usize, far: f32) -> Self {
        Self::of_points(cloud.ring(ring).iter().copied().flatten(), far)
    }

    /// From the points between two heights in the sensor's frame, m: walls and obstacles, whatever ring sees them.
    #[must_use]
    pub fn of_heights(cloud: &Cloud<'_>, low: f32, high: f32, far: f32) -> Self {
        Self::of_points(cloud.seen().filter(|[_, _, z]| (low..=high).contains(z)), far)
    }

    fn of_points(points: impl Iterator<Item = [f32; 3]>, far: f32) -> Self {
        let mut sums = [(0.0f32, 0u32); DIRECTIONS];
        for [x, y, _] in points {
            let range = libm::sqrtf(x * x + y * y);
            let direction = (libm::atan2f(y, x) / core::f32::consts::TAU + 0.5) * DIRECTIONS as f32;
            if range <= far
                && let Some((sum, count)) = sums.get_mut((direction as usize).min(DIRECTIONS - 1))
            {
                *sum += range;
                *count += 1;
            }
        }
        Self(sums.map(|(sum, count)| if count > 0 { sum / count as f32 } else { 0.0 }))
    }

    /// The angle by which `other` must be turned to lie on this one, rad, -pi to pi (M 5.3).
    #[must_use]
    pub fn turn(&self, other: &Self) -> f32 {
        least(&self.mismatches(other))
    }

    /// Sums of absolute differences, m, for each turn of the other.
    pub(super) fn mismatches(&self, other: &Self) -> [f32; DIRECTIONS] {
        core::array::from_fn(|shift| {
            let (end, begin) = other.0.split_at(DIRECTIONS - shift);
            self.0.iter().zip(begin.iter().chain(end)).map(|(a, b)| (a - b).abs()).sum()
        })
    }
}

/// The turn with the least mismatch, rad, -pi to pi; to a fraction of a direction by the parabola through it and its
/// neighbours.
pub(super) fn least(mismatches: &[f32; DIRECTIONS]) -> f32 {
    let (mut shift, mut at) = (0, f32::MAX);
    for (candidate, mismatch) in mismatches.iter().enumerate() {
        if *mismatch < at {
            (shift, at) = (candidate, *mismatch);
        }
    }
    let neighbour = |step: usize| mismatches.get((shift + step) % DIRECTIONS).copied().unwrap_or(at);
    let (before, after) = (neighbour(DIRECTIONS - 1), neighbour(1));
    let curvature = before - 2.0 * at + after;
    let fraction = if curvature > 0.0 { 0.5 * (before - after) / curvature } else { 0.0 };
    let turn = (shift as f32 + fraction) * (core::f32::consts::TAU / DIRECTIONS as f32);
    if turn > core::f32::consts::PI { turn - core::f32::consts::TAU } else { turn }
}
