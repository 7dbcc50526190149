//! State and covariance of the pose, and the two steps of the filter.

use nalgebra::{Matrix2, Matrix3, Vector2};

use super::Linearisation;
use super::positive_semidefinite::make_positive_semidefinite;
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

impl Innovation {
    /// None if the covariance is singular or not finite.
    #[must_use]
    pub fn new(residual: Vector2<f64>, covariance: Matrix2<f64>) -> Option<Self> {
        let normalised_square = (residual.transpose() * invert(&covariance)? * residual).x;
        normalised_square.is_finite().then_some(Self { residual, covariance, normalised_square })
    }
}

impl Ekf {
    /// A pose that is known with these standard deviations, m and rad.
    #[must_use]
    pub fn new(pose: Pose, position_deviation: f64, heading_deviation: f64) -> Self {
        let position = position_deviation * position_deviation;
        let heading = heading_deviation * heading_deviation;
        Self { pose, covariance: Matrix3::from_diagonal(&nalgebra::Vector3::new(position, position, heading)) }
    }

    /// The covariance as outputs state it: xx, xy, yy, x-heading, y-heading, heading-heading; m^2, m rad, rad^2. It is
    /// positive semidefinite, but for 1e-4 in a correlation.
    #[must_use]
    pub fn covariance_entries(&self) -> [f64; 6] {
        let mut covariance = self.covariance;
        make_positive_semidefinite(&mut covariance);
        [covariance.m11, covariance.m12, covariance.m22, covariance.m13, covariance.m23, covariance.m33]
    }

    /// Prediction, K 5.3 and 5.4: `F P F' + G Q G'`, written out, as `F` differs from identity in two places and `G`
    /// turns by the heading.
    pub fn predict(&mut self, motion: &Motion) {
        let (sine, cosine) = libm::sincos(self.pose.theta);
        let step = motion.displacement;
        let (x, y) = (cosine * step.x - sine * step.y, sine * step.x + cosine * step.y);
        let (p, q) = (&self.covariance, &motion.covariance);
        // The heading's error moves the end of the step sideways.
        let (x_heading, y_heading) = (p.m13 - y * p.m33, p.m23 + x * p.m33);
        let xx = p.m11 - y * (p.m13 + x_heading);
        let xy = p.m12 - y * p.m23 + x * x_heading;
        let yy = p.m22 + x * (p.m23 + y_heading);
        let (cross_x, cross_y) = (cosine * q.m13 - sine * q.m23, sine * q.m13 + cosine * q.m23);
        let (along, across, both) = (cosine * cosine, sine * sine, sine * cosine);
        let xx = xx + along * q.m11 - 2.0 * both * q.m12 + across * q.m22;
        let xy = xy + both * (q.m11 - q.m22) + (along - across) * q.m12;
        let yy = yy + across * q.m11 + 2.0 * both * q.m12 + along * q.m22;
        let (x_heading, y_heading) = (x_heading + cross_x, y_heading + cross_y);
        self.covariance = Matrix3::new(xx, xy, x_heading, xy, yy, y_heading, x_heading, y_heading, p.m33 + q.m33);
        self.pose = Pose::new(self.pose.x + x, self.pose.y + y, self.pose.theta + step.theta);
    }

    /// The innovation of an observation that was linearised at this pose. None if its covariance is singular or not
    /// finite.
    #[must_use]
    pub fn innovation(&self, observation: &Linearisation) -> Option<Innovation> {
        let covariance =
            observation.jacobian * self.covariance * observation.jacobian.transpose() + observation.covariance;
        Innovation::new(observation.residual, covariance)
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
        make_positive_semidefinite(&mut self.covariance);
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
