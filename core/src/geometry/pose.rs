//! Planar poses, the group SE(2), and its tangent space.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use super::{Point, wrap};

/// Position and heading of one frame in another.
///
/// `a.compose(&b)` is the compounding operator of K 2.4: the pose of C in A, given B in A and C in B.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Position along the first axis of the reference frame, m.
    pub x: f64,
    /// Position along the second axis of the reference frame, m.
    pub y: f64,
    /// Heading, rad, counter-clockwise from the first axis, in (-pi, pi].
    pub theta: f64,
}

/// A displacement with constant body velocity: the logarithm of a pose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Twist {
    /// Arc along the body's first axis, m.
    pub x: f64,
    /// Arc along the body's second axis, m.
    pub y: f64,
    /// Rotation, rad.
    pub theta: f64,
}

/// Below this rotation, rad, series replace the quotients of sine and cosine; their error is then under 1e-18.
const SMALL_ROTATION: f64 = 1e-4;

/// `sin(t)/t` and `(1 - cos t)/t`, continuous through zero.
fn arc_factors(theta: f64) -> (f64, f64) {
    if libm::fabs(theta) < SMALL_ROTATION {
        let square = theta * theta;
        (1.0 - square / 6.0 * (1.0 - square / 20.0), theta * 0.5 * (1.0 - square / 12.0))
    } else {
        let (sine, cosine) = libm::sincos(theta);
        // The second form does not cancel for small rotations.
        let versine = if cosine < 0.0 { 1.0 - cosine } else { sine * sine / (1.0 + cosine) };
        (sine / theta, versine / theta)
    }
}

impl Pose {
    /// The pose at `x`, `y` (m) with heading `theta` (rad, any turn).
    #[must_use]
    pub fn new(x: f64, y: f64, theta: f64) -> Self {
        Self { x, y, theta: wrap(theta) }
    }

    /// The position, m.
    #[must_use]
    pub fn position(&self) -> Point {
        Point::new(self.x, self.y)
    }

    /// The pose of C in A, where `self` is B in A and `other` is C in B (K 2.4).
    #[must_use]
    pub fn compose(&self, other: &Pose) -> Pose {
        let (sine, cosine) = libm::sincos(self.theta);
        Pose {
            x: self.x + cosine * other.x - sine * other.y,
            y: self.y + sine * other.x + cosine * other.y,
            theta: wrap(self.theta + other.theta),
        }
    }

    /// The pose of A in B, where `self` is B in A.
    #[must_use]
    pub fn inverse(&self) -> Pose {
        let (sine, cosine) = libm::sincos(self.theta);
        Pose { x: -(cosine * self.x + sine * self.y), y: sine * self.x - cosine * self.y, theta: wrap(-self.theta) }
    }

    /// The displacement from `self` to `other`, in the frame of `self`.
    #[must_use]
    pub fn between(&self, other: &Pose) -> Pose {
        let (sine, cosine) = libm::sincos(self.theta);
        let (dx, dy) = (other.x - self.x, other.y - self.y);
        Pose { x: cosine * dx + sine * dy, y: cosine * dy - sine * dx, theta: wrap(other.theta - self.theta) }
    }

    /// A point of the body in the reference frame, m.
    #[must_use]
    pub fn transform(&self, point: &Point) -> Point {
        let (sine, cosine) = libm::sincos(self.theta);
        Point::new(self.x + cosine * point.x - sine * point.y, self.y + sine * point.x + cosine * point.y)
    }

    /// A point of the reference frame in the body's frame, m.
    #[must_use]
    pub fn inverse_transform(&self, point: &Point) -> Point {
        let (sine, cosine) = libm::sincos(self.theta);
        let (dx, dy) = (point.x - self.x, point.y - self.y);
        Point::new(cosine * dx + sine * dy, cosine * dy - sine * dx)
    }

    /// The displacement that a constant body velocity makes (exponential map).
    #[must_use]
    pub fn exp(twist: &Twist) -> Pose {
        let (along, across) = arc_factors(twist.theta);
        Pose { x: along * twist.x - across * twist.y, y: across * twist.x + along * twist.y, theta: wrap(twist.theta) }
    }

    /// The constant body velocity that makes this displacement (logarithm), the one that turns by half a turn at most: of
    /// those that turn more, one that comes back to its heading moves beyond all bounds.
    #[must_use]
    pub fn log(&self) -> Twist {
        let theta = wrap(self.theta);
        let (along, across) = arc_factors(theta);
        let scale = 1.0 / (along * along + across * across);
        Twist { x: scale * (along * self.x + across * self.y), y: scale * (along * self.y - across * self.x), theta }
    }

    /// The part of this displacement that is made in the given share of its duration, at constant body velocity.
    #[must_use]
    pub fn fraction(&self, share: f64) -> Pose {
        let twist = self.log();
        Pose::exp(&Twist { x: twist.x * share, y: twist.y * share, theta: twist.theta * share })
    }

    /// Derivative of `self.compose(other)` by `self` (K 5.13 is this matrix for the tricycle's increment).
    #[must_use]
    pub fn compose_jacobian_first(&self, other: &Pose) -> Matrix3<f64> {
        let (sine, cosine) = libm::sincos(self.theta);
        Matrix3::new(
            1.0,
            0.0,
            -sine * other.x - cosine * other.y,
            0.0,
            1.0,
            cosine * other.x - sine * other.y,
            0.0,
            0.0,
            1.0,
        )
    }

    /// Derivative of `self.compose(other)` by `other`: the rotation of `self`.
    #[must_use]
    pub fn compose_jacobian_second(&self) -> Matrix3<f64> {
        let (sine, cosine) = libm::sincos(self.theta);
        Matrix3::new(cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0)
    }

    /// Whether all three components are finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.x.is_finite() && self.y.is_finite() && self.theta.is_finite()
    }
}
