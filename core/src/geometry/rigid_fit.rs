//! The rigid transform that fits pairs of points best.

use nalgebra::Matrix3;

use super::{Point, Pose};

/// A transform fitted to pairs of points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidFit {
    /// Pose of the source frame in the target frame.
    pub pose: Pose,
    /// Covariance of `pose` (x, y, theta; m, rad) if each pair differs by an error of unit variance (1 m^2) on each axis;
    /// the points' own variance scales it.
    pub unit_covariance: Matrix3<f64>,
    /// Root of the weighted mean of the squared distances that remain, m.
    pub residual: f64,
}

/// Fits the pose of the source frame in the target frame to pairs of points (source, target, weight) by weighted least
/// squares, in closed form. Reflections are never fitted: the best proper rotation is. None for fewer than two distinct
/// points.
#[must_use]
pub fn fit_rigid(pairs: impl Iterator<Item = (Point, Point, f64)> + Clone) -> Option<RigidFit> {
    let (mut weight, mut source_sum, mut target_sum) = (0.0, Point::zeros(), Point::zeros());
    for (source, target, share) in pairs.clone() {
        weight += share;
        source_sum += source * share;
        target_sum += target * share;
    }
    if weight.is_nan() || weight <= 0.0 {
        return None;
    }
    let (source_mean, target_mean) = (source_sum / weight, target_sum / weight);
    let (mut dot, mut cross, mut source_spread, mut target_spread) = (0.0, 0.0, 0.0, 0.0);
    for (source, target, share) in pairs {
        let (a, b) = (source - source_mean, target - target_mean);
        dot += share * a.dot(&b);
        cross += share * (a.x * b.y - a.y * b.x);
        source_spread += share * a.norm_squared();
        target_spread += share * b.norm_squared();
    }
    let strength = libm::sqrt(dot * dot + cross * cross);
    if strength.is_nan() || strength <= 1e-12 {
        return None;
    }
    let theta = libm::atan2(cross, dot);
    let (sine, cosine) = (cross / strength, dot / strength);
    let turned =
        Point::new(cosine * source_mean.x - sine * source_mean.y, sine * source_mean.x + cosine * source_mean.y);
    let position = target_mean - turned;
    let squares = (source_spread + target_spread - 2.0 * strength).max(0.0);

    // The heading is known from the spread; an error of it moves the origin, which lies `turned` before the mean.
    let heading = 1.0 / source_spread;
    let lever = Point::new(turned.y, -turned.x);
    let mean = 1.0 / weight;
    let unit_covariance = Matrix3::new(
        mean + heading * lever.x * lever.x,
        heading * lever.x * lever.y,
        heading * lever.x,
        heading * lever.x * lever.y,
        mean + heading * lever.y * lever.y,
        heading * lever.y,
        heading * lever.x,
        heading * lever.y,
        heading,
    );
    Some(RigidFit {
        pose: Pose::new(position.x, position.y, theta),
        unit_covariance,
        residual: libm::sqrt(squares / weight),
    })
}
