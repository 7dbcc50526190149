//! State and covariance of the pose, and the two steps of the filter.

use nalgebra::{Matrix2, Matrix3, Vector2};

use super::Linearisation;
use crate::geometry::{Pose, wrap};
use crate::odometry::Motion;

/// A pose with its covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ekf {
    /// Pose of R in W (K 5.1).
    pub pose: Pose,
    /// Covariance of x, y (m) and heading (rad), in W.
    pub covariance: Matrix3<f64>,
}

/// How far an observation is from what was expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Innovation {
    /// Observation minus expectation, in the units of the observation.
    pub residual: Vector2<f64>,
    /// Covariance of the residual (K 5.5: the bracket).
    pub covariance: Matrix2<f64>,
    /// Squared Mahalanobis length of the residual; chi-square with two degrees of freedom if all is well.
    pub normalised_square: f64,
}

impl Ekf {
    /// A pose that is known with these standard deviations, m and rad.
    #[must_use]
    pub fn new(pose: Pose, position_deviation: f64, heading_deviation: f64) -> Self {
        let position = position_deviation * position_deviation;
        let heading = heading_deviation * heading_deviation;
        Self { pose, covariance: Matrix3::from_diagonal(&nalgebra::Vector3::new(position, position, heading)) }
    }

    /// Prediction, K 5.3 and 5.4.
    pub fn predict(&mut self, motion: &Motion) {
        let by_pose = self.pose.compose_jacobian_first(&motion.displacement);
        let by_motion = self.pose.compose_jacobian_second();
        self.covariance =
            by_pose * self.covariance * by_pose.transpose() + by_motion * motion.covariance * by_motion.transpose();
        self.symmetrise();
        self.pose = self.pose.compose(&motion.displacement);
    }

    /// The innovation of an observation that was linearised at this pose. None if its covariance is singular or not
    /// finite.
    #[must_use]
    pub fn innovation(&self, observation: &Linearisation) -> Option<Innovation> {
        let covariance =
            observation.jacobian * self.covariance * observation.jacobian.transpose() + observation.covariance;
        let information = invert(&covariance)?;
        let normalised_square = (observation.residual.transpose() * information * observation.residual).x;
        normalised_square.is_finite().then_some(Innovation {
            residual: observation.residual,
            covariance,
            normalised_square,
        })
    }

    /// Correction, K 5.5 to 5.7, the last in Joseph's form, which stays symmetric and positive whatever the gain. False,
    /// and nothing changed, if the innovation's covariance is singular or not finite.
    pub fn correct(&mut self, observation: &Linearisation) -> bool {
        let cross = self.covariance * observation.jacobian.transpose();
        let Some(information) = invert(&(observation.jacobian * cross + observation.covariance)) else {
            return false;
        };
        let gain = cross * information;
        let change = gain * observation.residual;
        if !change.iter().all(|entry| entry.is_finite()) {
            return false;
        }
        self.pose.x += change.x;
        self.pose.y += change.y;
        self.pose.theta = wrap(self.pose.theta + change.z);
        let remaining = Matrix3::identity() - gain * observation.jacobian;
        self.covariance =
            remaining * self.covariance * remaining.transpose() + gain * observation.covariance * gain.transpose();
        self.symmetrise();
        true
    }

    /// Standard deviation of the position in its worst direction, m.
    #[must_use]
    pub fn position_deviation(&self) -> f64 {
        let (xx, xy, yy) = (self.covariance.m11, self.covariance.m12, self.covariance.m22);
        let mean = 0.5 * (xx + yy);
        libm::sqrt((mean + libm::hypot(0.5 * (xx - yy), xy)).max(0.0))
    }

    /// Standard deviation of the heading, rad.
    #[must_use]
    pub fn heading_deviation(&self) -> f64 {
        libm::sqrt(self.covariance.m33.max(0.0))
    }

    fn symmetrise(&mut self) {
        self.covariance = (self.covariance + self.covariance.transpose()) * 0.5;
    }
}

/// The inverse of a symmetric positive matrix; None if it is not one.
fn invert(matrix: &Matrix2<f64>) -> Option<Matrix2<f64>> {
    let determinant = matrix.m11 * matrix.m22 - matrix.m12 * matrix.m21;
    if !(determinant.is_finite() && determinant > 0.0 && matrix.m11 > 0.0) {
        return None;
    }
    let scale = 1.0 / determinant;
    scale
        .is_finite()
        .then(|| Matrix2::new(matrix.m22 * scale, -matrix.m12 * scale, -matrix.m21 * scale, matrix.m11 * scale))
}
