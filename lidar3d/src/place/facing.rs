//! Where the walls of a place face: a signature that hardly changes as the sensor moves between them.
//!
//! Beside the single-beam signature of M 5.3, whose distances change with every metre: directions of surfaces do not.

use super::normals::{Neighbours, surfaces};
use super::orientation::{DIRECTIONS, Orientation, least};
use crate::cloud::Cloud;

/// Surfaces whose normal rises by less than this, sine, are walls.
const LEVEL: f32 = 0.3;
/// Share of the distances against that of the directions in the choice of a turn.
const RANGE_SHARE: f32 = 0.2;
/// Standard deviation of the smoothing, in directions, and how far it reaches.
const SMOOTHING: f32 = 2.0;
const SMOOTHING_REACH: usize = 6;

/// Share of the walls by the direction in which they face, as square roots: the sum of their squares is one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facing(pub [f32; DIRECTIONS]);

impl Facing {
    /// Of a scan.
    #[must_use]
    pub fn new(cloud: &Cloud<'_>, neighbours: &Neighbours) -> Self {
        let mut counts = [0.0f32; DIRECTIONS];
        surfaces(cloud, neighbours, |_, [x, y, z]| {
            if z.abs() < LEVEL {
                let direction = (libm::atan2f(y, x) / core::f32::consts::TAU + 0.5) * DIRECTIONS as f32;
                if let Some(count) = counts.get_mut((direction as usize).min(DIRECTIONS - 1)) {
                    *count += 1.0;
                }
            }
        });
        let total: f32 = counts.iter().sum();
        let kernel: [f32; 2 * SMOOTHING_REACH + 1] = core::array::from_fn(|place| {
            let off = (place as f32 - SMOOTHING_REACH as f32) / SMOOTHING;
            libm::expf(-0.5 * off * off)
        });
        let weight: f32 = kernel.iter().sum::<f32>() * total.max(1.0);
        let smoothed = |direction: usize| {
            let first = direction + DIRECTIONS - SMOOTHING_REACH;
            let around = counts.iter().cycle().skip(first % DIRECTIONS);
            libm::sqrtf(kernel.iter().zip(around).map(|(share, count)| share * count).sum::<f32>() / weight)
        };
        Self(core::array::from_fn(smoothed))
    }

    /// How unlike two places are, whatever way the sensor was turned: 0 for the same, 1 for places that share no wall.
    #[must_use]
    pub fn distance(&self, other: &Self) -> f32 {
        self.mismatches(other).into_iter().fold(1.0, f32::min)
    }

    /// One less the cosine of the angle between both, for each turn of the other.
    fn mismatches(&self, other: &Self) -> [f32; DIRECTIONS] {
        let length = |facing: &Self| libm::sqrtf(facing.0.iter().map(|value| value * value).sum());
        let scale = (length(self) * length(other)).max(f32::MIN_POSITIVE);
        core::array::from_fn(|shift| {
            let (end, begin) = other.0.split_at(DIRECTIONS - shift);
            let turned = begin.iter().chain(end);
            1.0 - self.0.iter().zip(turned).map(|(a, b)| a * b).sum::<f32>() / scale
        })
    }
}

/// The angle by which the `other` scan must be turned to lie on this one, rad, -pi to pi. The directions of the walls
/// determine it, and their distances, with a smaller share, which of the walls is which.
#[must_use]
pub fn relative_turn(one: (&Orientation, &Facing), other: (&Orientation, &Facing)) -> f32 {
    let ranges = spread(one.0.mismatches(other.0));
    let directions = spread(one.1.mismatches(other.1));
    least(&core::array::from_fn(|shift| {
        RANGE_SHARE * ranges.get(shift).unwrap_or(&0.0) + (1.0 - RANGE_SHARE) * directions.get(shift).unwrap_or(&0.0)
    }))
}

/// Between 0 for the least value and 1 for the greatest.
fn spread(values: [f32; DIRECTIONS]) -> [f32; DIRECTIONS] {
    let (low, high) =
        values.iter().fold((f32::MAX, f32::MIN), |(low, high), value| (low.min(*value), high.max(*value)));
    let width = (high - low).max(f32::MIN_POSITIVE);
    values.map(|value| (value - low) / width)
}
