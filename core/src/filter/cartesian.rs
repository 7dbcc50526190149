//! Position of a landmark.

use nalgebra::Matrix2;
use serde::{Deserialize, Serialize};

use super::viewpoint::{Believed, Model, Viewpoint, left};
use crate::geometry::Point;

/// Position of a landmark in S.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cartesian {
    /// Position, m.
    pub position: Point,
    /// Covariance of the position, m^2.
    pub covariance: Matrix2<f64>,
}

impl Cartesian {
    /// The two-dimensional Cartesian observation model that K 5.3 mentions.
    pub(super) fn model(&self, from: &Viewpoint, landmark: &Believed) -> Model {
        let expected = from.inwards(&(landmark.position - from.position - from.arm));
        let reach = landmark.anchor - from.anchor;
        Model {
            residual: self.position - expected,
            by_position: [Point::new(1.0, 0.0), Point::new(0.0, 1.0)].map(|axis| -from.inwards(&axis)),
            by_heading: -from.inwards(&left(&reach)),
            by_yaw: -from.inwards(&left(&(reach - from.arm))),
            covariance: self.covariance + Matrix2::identity() * landmark.variance,
        }
    }
}
