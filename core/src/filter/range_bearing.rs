//! Distance and direction of a landmark.

use nalgebra::{Matrix2, Matrix2x3, Vector2};

use super::{Cartesian, Linearisation};
use crate::geometry::{Point, Pose, difference};

/// Nearer than this, m, the direction of a landmark means nothing.
const NEAREST: f64 = 1e-3;

/// Distance and direction of a landmark from S.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeBearing {
    /// Distance, m.
    pub range: f64,
    /// Direction in S, rad.
    pub bearing: f64,
    /// Variance of the distance, m^2.
    pub range_variance: f64,
    /// Variance of the direction, rad^2.
    pub bearing_variance: f64,
}

impl RangeBearing {
    /// The same as a position.
    #[must_use]
    pub fn cartesian(&self) -> Cartesian {
        let (sine, cosine) = libm::sincos(self.bearing);
        let across = self.range * self.range * self.bearing_variance;
        let both = (self.range_variance - across) * sine * cosine;
        Cartesian {
            position: Point::new(self.range * cosine, self.range * sine),
            covariance: Matrix2::new(
                self.range_variance * cosine * cosine + across * sine * sine,
                both,
                both,
                self.range_variance * sine * sine + across * cosine * cosine,
            ),
        }
    }

    /// K 5.14 to 5.16, which are printed for a sensor at the logical point; here the sensor sits at `laser`.
    pub(super) fn linearise(
        &self,
        pose: &Pose,
        laser: &Pose,
        landmark: &Point,
        landmark_variance: f64,
    ) -> Option<Linearisation> {
        let (sine, cosine) = libm::sincos(pose.theta);
        // The sensor's position relative to R, turned into W.
        let arm = Point::new(cosine * laser.x - sine * laser.y, sine * laser.x + cosine * laser.y);
        let (dx, dy) = (landmark.x - pose.x - arm.x, landmark.y - pose.y - arm.y);
        let square = dx * dx + dy * dy;
        let range = libm::sqrt(square);
        if range.is_nan() || range <= NEAREST {
            return None;
        }
        let bearing = libm::atan2(dy, dx) - pose.theta - laser.theta;
        let jacobian = Matrix2x3::new(
            -dx / range,
            -dy / range,
            (dx * arm.y - dy * arm.x) / range,
            dy / square,
            -dx / square,
            -(dx * arm.x + dy * arm.y) / square - 1.0,
        );
        Some(Linearisation {
            residual: Vector2::new(self.range - range, difference(self.bearing, bearing)),
            jacobian,
            covariance: Matrix2::new(
                self.range_variance + landmark_variance,
                0.0,
                0.0,
                self.bearing_variance + landmark_variance / square,
            ),
        })
    }
}
