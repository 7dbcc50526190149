//! From where landmarks are seen, and what an observation says of that.

use nalgebra::{Matrix2, Vector2};

use crate::geometry::{Point, Pose};

/// Where S is in W, and how that turns.
#[derive(Clone, Copy, Debug)]
pub struct Viewpoint {
    /// Position of R, m.
    pub(super) position: Point,
    /// Position of R for the Jacobians, m.
    pub(super) anchor: Point,
    /// Position of S minus that of R, m, in W.
    pub(super) arm: Point,
    /// Direction of S in W, rad, not wrapped.
    pub(super) theta: f64,
    /// Its sine.
    pub(super) sine: f64,
    /// Its cosine.
    pub(super) cosine: f64,
    /// Whether the yaw is part of the state.
    pub(super) has_yaw: bool,
}

/// A landmark, as it is believed to be.
#[derive(Clone, Copy, Debug)]
pub(super) struct Believed {
    /// Position in W, m.
    pub position: Point,
    /// Position for the Jacobians, m.
    pub anchor: Point,
    /// Variance of the position an axis, m^2, if the landmark is not in the state.
    pub variance: f64,
}

/// What an observation says of the pose, the yaw of S and the landmark.
#[derive(Clone, Copy, Debug)]
pub(super) struct Model {
    /// Observation minus expectation.
    pub residual: Vector2<f64>,
    /// Derivative of the expectation by the position of R, an axis each; by that of the landmark it is the same, negative.
    pub by_position: [Vector2<f64>; 2],
    /// By the heading of R.
    pub by_heading: Vector2<f64>,
    /// By the yaw of S.
    pub by_yaw: Vector2<f64>,
    /// Covariance of the observation, and of a landmark that is not in the state.
    pub covariance: Matrix2<f64>,
}

impl Viewpoint {
    /// S is mounted at `mount` in R, turned from there by the `yaw` (rad) of the state, if that is there.
    pub(super) fn new(pose: &Pose, anchor: Point, mount: &Pose, yaw: Option<f64>) -> Self {
        let (heading_sine, heading_cosine) = libm::sincos(pose.theta);
        let theta = pose.theta + mount.theta + yaw.unwrap_or(0.0);
        let (sine, cosine) = libm::sincos(theta);
        let arm = Point::new(
            heading_cosine * mount.x - heading_sine * mount.y,
            heading_sine * mount.x + heading_cosine * mount.y,
        );
        Self { position: pose.position(), anchor, arm, theta, sine, cosine, has_yaw: yaw.is_some() }
    }

    /// From W to S.
    pub(super) fn inwards(&self, vector: &Point) -> Vector2<f64> {
        Vector2::new(self.cosine * vector.x + self.sine * vector.y, self.cosine * vector.y - self.sine * vector.x)
    }

    /// From S to W.
    pub(super) fn outwards(&self, vector: &Point) -> Point {
        Point::new(self.cosine * vector.x - self.sine * vector.y, self.sine * vector.x + self.cosine * vector.y)
    }

    /// Direction of S in W, rad, not wrapped.
    #[must_use]
    pub const fn theta(&self) -> f64 {
        self.theta
    }

    /// Where a point that is seen at `position` in S is in W, m.
    #[must_use]
    pub fn locate(&self, position: &Point) -> Point {
        self.position + self.arm + self.outwards(position)
    }
}

/// A vector turned to the left by a right angle.
pub(super) fn left(vector: &Point) -> Point {
    Point::new(-vector.y, vector.x)
}
