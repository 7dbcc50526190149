//! Position of a landmark.

use nalgebra::{Matrix2, Matrix2x3};

use super::Linearisation;
use crate::geometry::{Point, Pose};

/// Position of a landmark in S.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cartesian {
    /// Position, m.
    pub position: Point,
    /// Covariance of the position, m^2.
    pub covariance: Matrix2<f64>,
}

impl Cartesian {
    /// The two-dimensional Cartesian observation model that K 5.3 mentions, for a sensor at `laser`.
    pub(super) fn linearise(
        &self,
        pose: &Pose,
        laser: &Pose,
        landmark: &Point,
        landmark_variance: f64,
    ) -> Linearisation {
        let (sine, cosine) = libm::sincos(pose.theta + laser.theta);
        let (heading_sine, heading_cosine) = libm::sincos(pose.theta);
        let (dx, dy) = (landmark.x - pose.x, landmark.y - pose.y);
        let arm = Point::new(
            heading_cosine * laser.x - heading_sine * laser.y,
            heading_sine * laser.x + heading_cosine * laser.y,
        );
        let (ex, ey) = (dx - arm.x, dy - arm.y);
        let expected = Point::new(cosine * ex + sine * ey, cosine * ey - sine * ex);
        let jacobian = Matrix2x3::new(-cosine, -sine, cosine * dy - sine * dx, sine, -cosine, -sine * dy - cosine * dx);
        Linearisation {
            residual: self.position - expected,
            jacobian,
            covariance: self.covariance + Matrix2::identity() * landmark_variance,
        }
    }
}
