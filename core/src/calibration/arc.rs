//! The arc that a segment's sums stand for, and its derivatives.

use nalgebra::{Matrix2, Vector2};

use crate::geometry::{Pose, Twist};

/// An arc of R: where it ends, and how the end's position changes with the parameters.
pub(super) struct Arc {
    /// The end in R at the start; the rotation is not wrapped.
    pub position: Vector2<f64>,
    /// Derivative of the position by the steering offset (first column) and by the turn scale (second).
    pub derivative: Matrix2<f64>,
}

/// The arc of constant steering that has the segment's sums (K 2.8 and 2.9, continuous through straight motion).
pub(super) fn arc(sine: f64, cosine: f64, offset: f64, turn_scale: f64, wheelbase: f64) -> Arc {
    let (offset_sine, offset_cosine) = libm::sincos(offset);
    let along = cosine * offset_cosine - sine * offset_sine;
    let across = sine * offset_cosine + cosine * offset_sine;
    let (distance, rotation) = (wheelbase * turn_scale * along, turn_scale * across);
    let end = |rotation: f64| {
        let pose = Pose::exp(&Twist { x: 1.0, y: 0.0, theta: rotation });
        Vector2::new(pose.x, pose.y)
    };
    let unit = end(rotation);
    // d/dt of the integral of (cos ut, sin ut) over u: the difference of end and mean direction.
    let by_rotation = if libm::fabs(rotation) < 1e-3 {
        Vector2::new(-rotation / 3.0, 0.5 - rotation * rotation / 8.0)
    } else {
        (Vector2::new(libm::cos(rotation), libm::sin(rotation)) - unit) / rotation
    };
    let by_offset = unit * (-wheelbase * turn_scale * across) + by_rotation * (distance * turn_scale * along);
    let by_scale = unit * (wheelbase * along) + by_rotation * (distance * across);
    Arc { position: unit * distance, derivative: Matrix2::from_columns(&[by_offset, by_scale]) }
}
