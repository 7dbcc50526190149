//! The floor under a sensor: how high the sensor stands above it, and how it leans.

use super::solved::solved;
use crate::cloud::Cloud;

/// Points of floor are looked for at these distances, m, first the nearer ones: a leaning sensor sees the farther ones at
/// very different heights.
const REACHES: [f32; 3] = [8.0, 14.0, 20.0];
const NEAREST: f32 = 3.0;
/// Heights of the sensor that are looked at, and the width of a class of heights, m.
const HEIGHTS: [f32; 2] = [0.3, 3.3];
const CLASS: f32 = 0.1;
const CLASSES: usize = 30;
/// The floor is the lowest class that has this part of the points of the fullest one: what stands on it is higher.
const LEAST: f32 = 0.25;
/// How far from the plane points count, m, fit by fit.
const BANDS: [f32; 3] = [0.4, 0.2, 0.12];
/// A plane of fewer points is none.
const POINTS: u32 = 50;
/// A floor does not lean more, as the tangent of the angle.
const STEEPEST: f32 = 0.3;

/// A slope that may be the ground's, as the tangent of 2.2 deg.
const SMALL_SLOPE: f32 = 0.038;

/// The plane z = `height` below the sensor, with its leaning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Floor {
    /// Of the sensor above the floor, m.
    pub height: f32,
    /// How much the floor rises for every metre ahead and to the left.
    pub slope: [f32; 2],
}

impl Floor {
    /// A level floor.
    #[must_use]
    pub const fn level(height: f32) -> Self {
        Self { height, slope: [0.0; 2] }
    }

    /// Finds the floor in a scan; None if there is no plane below the sensor.
    #[must_use]
    pub fn find(cloud: &Cloud<'_>) -> Option<Self> {
        let mut floor = Self::level(lowest_plane(cloud)?);
        for reach in REACHES {
            for band in BANDS {
                floor = floor.refitted(cloud, reach, band)?;
            }
        }
        (floor.slope.iter().all(|slope| libm::fabsf(*slope) < STEEPEST) && floor.height > 0.0).then_some(floor)
    }

    /// Without a slope of less than 2.2 deg, which is more often the ground's than the sensor's: the images of places are
    /// made from scans of the same ground.
    #[must_use]
    pub fn without_small_slope(self) -> Self {
        let [a, b] = self.slope;
        if a * a + b * b < SMALL_SLOPE * SMALL_SLOPE { Self::level(self.height) } else { self }
    }

    /// A point as it is above this floor: turned so that the floor is level, with its height above it, m.
    #[must_use]
    #[inline]
    pub fn levelled(&self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        let [a, b] = self.slope;
        // The normal of the floor is (-a, -b, 1); a small turn about a level axis brings it upright.
        let length = libm::sqrtf(1.0 + a * a + b * b);
        let up = (z - a * x - b * y) / length;
        let along = z - (a * x + b * y) / (1.0 + length);
        [(x + a * along / length), (y + b * along / length), up + self.height / length]
    }

    /// Height of a point above the floor, straight up, m.
    fn above(&self, [x, y, z]: [f32; 3]) -> f32 {
        z + self.height - self.slope[0] * x - self.slope[1] * y
    }

    /// The plane of least squares through what is near to this one.
    fn refitted(&self, cloud: &Cloud<'_>, reach: f32, band: f32) -> Option<Self> {
        let mut sums = [[0.0_f64; 4]; 3];
        let mut count = 0;
        for [x, y, z] in cloud.seen() {
            let far = x * x + y * y;
            if far < NEAREST * NEAREST || far > reach * reach || libm::fabsf(self.above([x, y, z])) > band {
                continue;
            }
            count += 1;
            let row = [f64::from(x), f64::from(y), 1.0];
            for (sum, factor) in sums.iter_mut().zip(row) {
                for (sum, value) in sum.iter_mut().zip([row[0], row[1], row[2], f64::from(z)]) {
                    *sum += factor * value;
                }
            }
        }
        if count < POINTS {
            return None;
        }
        let [a, b, c] = solved(sums)?;
        Some(Self { height: -c as f32, slope: [a as f32, b as f32] })
    }
}

/// How far the lowest plane below the sensor lies, m.
fn lowest_plane(cloud: &Cloud<'_>) -> Option<f32> {
    let mut counts = [0.0_f32; CLASSES];
    for [x, y, z] in cloud.seen() {
        let far = x * x + y * y;
        if (NEAREST * NEAREST..REACHES[0] * REACHES[0]).contains(&far) && -z > HEIGHTS[0] && -z < HEIGHTS[1] {
            let class = ((-z - HEIGHTS[0]) / CLASS) as usize;
            if let Some(count) = counts.get_mut(class) {
                *count += 1.0;
            }
        }
    }
    let most = counts.iter().copied().fold(0.0, f32::max);
    let class = counts.iter().rposition(|count| most > 0.0 && *count >= LEAST * most)?;
    Some(HEIGHTS[0] + CLASS * (class as f32 + 0.5))
}
