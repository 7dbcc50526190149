//! Distance and direction of a landmark.

use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};

use super::Cartesian;
use super::viewpoint::{Believed, Model, Viewpoint};
use crate::geometry::{Point, difference};

/// Nearer than this, m, the direction of a landmark means nothing.
const NEAREST: f64 = 1e-3;

/// Distance and direction of a landmark from S.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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

    /// K 5.14 to 5.16, which are printed for a sensor at the logical point; here the sensor sits elsewhere.
    pub(super) fn model(&self, from: &Viewpoint, landmark: &Believed) -> Option<Model> {
        let (dx, dy) =
            (landmark.position.x - from.position.x - from.arm.x, landmark.position.y - from.position.y - from.arm.y);
        let square = dx * dx + dy * dy;
        let range = libm::sqrt(square);
        if range.is_nan() || range <= NEAREST {
            return None;
        }
        let bearing = libm::atan2(dy, dx) - from.theta;
        // How range and bearing change if everything turns to the left about a point from which the landmark is seen there.
        let by_turn = |reach: &Point| {
            Vector2::new((dx * reach.y - dy * reach.x) / range, -(dx * reach.x + dy * reach.y) / square)
        };
        let reach = landmark.anchor - from.anchor;
        Some(Model {
            residual: Vector2::new(self.range - range, difference(self.bearing, bearing)),
            by_position: [Vector2::new(-dx / range, dy / square), Vector2::new(-dy / range, -dx / square)],
            by_heading: by_turn(&reach),
            by_yaw: by_turn(&(reach - from.arm)),
            covariance: Matrix2::new(
                self.range_variance + landmark.variance,
                0.0,
                0.0,
                self.bearing_variance + landmark.variance / square,
            ),
        })
    }
}
