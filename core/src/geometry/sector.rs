//! Equal sectors around a point.

use core::f32::consts::{FRAC_PI_2, PI, TAU};

use super::ScanPoint;

/// Coefficients of an arctangent in odd powers, for arguments up to 1 (Abramowitz and Stegun 4.4.49).
const COEFFICIENTS: [f32; 5] = [0.020_835_1, -0.085_133, 0.180_141, -0.330_299_5, 0.999_866];

/// More than its largest error and that of single precision, turns.
const DOUBT: f32 = 4e-6;

/// In which of `count` equal sectors a point lies; they go counter-clockwise from the negative x axis on. It is
/// that which the arctangent of the point says, and costs one only near to a border.
#[must_use]
#[inline]
pub fn sector(point: &ScanPoint, count: usize) -> usize {
    let share = nearly(point) * count as f32;
    let sector = share as usize;
    let (inside, doubt) = (share - sector as f32, DOUBT * count as f32);
    if inside > doubt && inside < 1.0 - doubt { sector } else { exactly(point, count) }
}

/// The direction of a point from the negative x axis on, turns, within [`DOUBT`].
#[inline(always)]
fn nearly(point: &ScanPoint) -> f32 {
    let (x, y) = (libm::fabsf(point.x), libm::fabsf(point.y));
    let is_steep = y > x;
    let ratio = if is_steep { x / y } else { y / x };
    let square = ratio * ratio;
    let angle = COEFFICIENTS.iter().fold(0.0, |sum, coefficient| sum * square + coefficient) * ratio;
    let angle = if is_steep { FRAC_PI_2 - angle } else { angle };
    let angle = if point.x < 0.0 { PI - angle } else { angle };
    libm::copysignf(angle, point.y) / TAU + 0.5
}

#[cold]
fn exactly(point: &ScanPoint, count: usize) -> usize {
    let share = libm::atan2f(point.y, point.x) / TAU + 0.5;
    ((share * count as f32) as usize).min(count.saturating_sub(1))
}
