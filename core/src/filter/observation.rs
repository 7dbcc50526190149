//! What a landmark looks like from the vehicle.

use nalgebra::{Matrix2, Matrix2x3, Vector2};

use super::{Cartesian, RangeBearing};
use crate::geometry::{Point, Pose};

/// One landmark, seen from S.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Observation {
    /// Distance and direction (K 5.14).
    RangeBearing(RangeBearing),
    /// Position (K 5.3, last paragraph of the observation model).
    Cartesian(Cartesian),
}

/// An observation model, linearised at a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linearisation {
    /// Observation minus expectation.
    pub residual: Vector2<f64>,
    /// Derivative of the expectation by the pose of R (K: H).
    pub jacobian: Matrix2x3<f64>,
    /// Covariance of the observation (K: Q) and of the landmark's position, seen from S.
    pub covariance: Matrix2<f64>,
}

impl Observation {
    /// Compares the observation with a landmark at `landmark` (m, in W, known to `landmark_variance` m^2 an axis) for a
    /// vehicle at `pose` with its sensor at `laser` in R. None if the landmark is at the sensor.
    #[must_use]
    pub fn linearise(
        &self,
        pose: &Pose,
        laser: &Pose,
        landmark: &Point,
        landmark_variance: f64,
    ) -> Option<Linearisation> {
        match self {
            Self::RangeBearing(seen) => seen.linearise(pose, laser, landmark, landmark_variance),
            Self::Cartesian(seen) => Some(seen.linearise(pose, laser, landmark, landmark_variance)),
        }
    }

    /// Where the landmark is in W if the vehicle is at `pose`, m.
    #[must_use]
    pub fn locate(&self, pose: &Pose, laser: &Pose) -> Point {
        pose.compose(laser).transform(&self.position())
    }

    /// Where the landmark is in S, m.
    #[must_use]
    pub fn position(&self) -> Point {
        match self {
            Self::RangeBearing(seen) => {
                let (sine, cosine) = libm::sincos(seen.bearing);
                Point::new(seen.range * cosine, seen.range * sine)
            }
            Self::Cartesian(seen) => seen.position,
        }
    }
}
