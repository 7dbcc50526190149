//! Angles on the circle.

use core::f64::consts::{PI, TAU};

/// Brings an angle, rad, into the interval (-pi, pi].
///
/// Exact for angles that are already inside; NaN and infinities give NaN.
#[must_use]
pub fn wrap(angle: f64) -> f64 {
    if angle > -PI && angle <= PI {
        return angle;
    }
    // Exact, and from -pi to pi.
    let remainder = libm::remainder(angle, TAU);
    if remainder <= -PI { PI } else { remainder }
}

/// The shortest rotation that leads from `from` to `to`, rad, in (-pi, pi].
#[must_use]
pub fn difference(to: f64, from: f64) -> f64 {
    wrap(to - from)
}
