//! Bias and scale of a gyro as states beside the pose.
//!
//! What landmarks say depends on them through the pose alone. So a correction of the pose, whoever has made it, changes them by their
//! regression on it: with the joint covariance `P`, `B = P_gp P_pp^-1`, they change by `B` times the change of the pose, and
//! `P_gg` by `B (P_pp' - P_pp) B'`. That is the update of one filter with all states (K 5.5 to 5.7), written for those that are
//! not observed themselves. A vehicle without a gyro has no such states, and its filter is as it was.

use nalgebra::{Matrix2, Matrix2x3, Matrix3, Matrix3x2, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use crate::geometry::{Pose, difference};
use crate::measurement::Time;
use crate::odometry::{GyroErrors, GyroParameters, GyroTurn, Motion};

/// A pose, and its covariance in W: x, y, heading.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct KnownPose {
    /// Pose of R in W.
    pub pose: Pose,
    /// Its covariance, m and rad.
    pub covariance: Matrix3<f64>,
}

impl KnownPose {
    /// The motion to a pose that was known later, apart from this one: in R here.
    #[must_use]
    pub fn motion_to(&self, later: &Self, start: Time, end: Time) -> Motion {
        let displacement = self.pose.between(&later.pose);
        let (sine, cosine) = libm::sincos(self.pose.theta);
        let to_robot = Matrix3::new(cosine, sine, 0.0, -sine, cosine, 0.0, 0.0, 0.0, 1.0);
        let covariance = to_robot * (self.covariance + later.covariance) * to_robot.transpose();
        let distance = libm::hypot(displacement.x, displacement.y);
        Motion { start, end, displacement, covariance, distance }
    }
}

/// Bias and scale, their covariance, and that with the pose of now.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct GyroState {
    errors: GyroErrors,
    own: Matrix2<f64>,
    with_pose: Matrix3x2<f64>,
    priors: Vector2<f64>,
    drift: f64,
}

/// A bias that stands is not known better than the gyro's flicker lets it be, which the walk has not: a share of its prior.
const LEAST_SHARE: f64 = 1e-4;

impl GyroState {
    /// A gyro that was just switched on.
    #[must_use]
    pub fn new(parameters: &GyroParameters) -> Self {
        let priors = Vector2::new(parameters.bias * parameters.bias, parameters.scale * parameters.scale);
        Self {
            errors: GyroErrors::default(),
            own: Matrix2::from_diagonal(&priors),
            with_pose: Matrix3x2::zeros(),
            priors,
            drift: parameters.drift * parameters.drift,
        }
    }

    /// What is known of the errors.
    #[must_use]
    pub const fn errors(&self) -> &GyroErrors {
        &self.errors
    }

    /// Standard deviations of the bias, rad/s, and of the scale.
    #[must_use]
    pub fn deviations(&self) -> (f64, f64) {
        (libm::sqrt(self.own.m11.max(0.0)), libm::sqrt(self.own.m22.max(0.0)))
    }

    /// Covariance of bias and scale.
    #[must_use]
    pub const fn covariance(&self) -> &Matrix2<f64> {
        &self.own
    }

    /// The pose has begun anew, and nothing of it is known from the gyro.
    pub fn begin_pose(&mut self) {
        self.with_pose = Matrix3x2::zeros();
    }

    /// Nothing is known of the bias but that it is about here, rad/s.
    pub fn begin_bias(&mut self, bias: f64) {
        self.errors.bias = bias;
        self.own = Matrix2::new(self.priors.x, 0.0, 0.0, self.own.m22);
        (self.with_pose.m11, self.with_pose.m21, self.with_pose.m31) = (0.0, 0.0, 0.0);
    }

    /// Goes on by a displacement from a heading (rad, in W) in so many seconds, whose turn the gyro has told, if it has. Returns
    /// what the errors add to the covariance of the displacement, in R at its start.
    #[must_use]
    pub fn predict(
        &mut self,
        heading: f64,
        displacement: &Pose,
        duration: f64,
        turn: Option<&GyroTurn>,
    ) -> Matrix3<f64> {
        let (sine, cosine) = libm::sincos(heading);
        let Pose { x, y, .. } = *displacement;
        let (moved_x, moved_y) = (cosine * x - sine * y, sine * x + cosine * y);
        let before = self.with_pose;
        self.with_pose = Matrix3x2::new(
            before.m11 - moved_y * before.m31,
            before.m12 - moved_y * before.m32,
            before.m21 + moved_x * before.m31,
            before.m22 + moved_x * before.m32,
            before.m31,
            before.m32,
        );
        let mut added = Matrix3::zeros();
        if let Some(turn) = turn {
            // The chord has half of the turn.
            let by_turn = Vector2::new(-turn.duration, turn.angle);
            let in_robot = Vector3::new(-0.5 * y, 0.5 * x, 1.0);
            let in_world = Vector3::new(-0.5 * moved_y, 0.5 * moved_x, 1.0);
            let common = self.with_pose * by_turn;
            let common =
                Vector3::new(cosine * common.x + sine * common.y, cosine * common.y - sine * common.x, common.z);
            let own = self.own * by_turn;
            let variance = by_turn.dot(&own);
            added = in_robot * common.transpose()
                + common * in_robot.transpose()
                + variance * in_robot * in_robot.transpose();
            self.with_pose += in_world * own.transpose();
        }
        self.own.m11 = (self.own.m11 + self.drift * duration.max(0.0)).min(4.0 * self.priors.x);
        added
    }

    /// The pose of now was corrected by something that does not depend on the gyro. Nothing changes if the covariance before
    /// is singular.
    pub fn correct(&mut self, before: &KnownPose, after: &KnownPose) {
        let Some(inverse) = before.covariance.try_inverse() else { return };
        let share: Matrix2x3<f64> = self.with_pose.transpose() * inverse;
        let change = Vector3::new(
            after.pose.x - before.pose.x,
            after.pose.y - before.pose.y,
            difference(after.pose.theta, before.pose.theta),
        );
        let by = share * change;
        let less = share * (before.covariance - after.covariance) * share.transpose();
        let own = self.own - less;
        let with_pose = (share * after.covariance).transpose();
        let is_sound = own.m11 > 0.0 && own.m22 > 0.0 && own.determinant() > 0.0;
        let is_finite = by.iter().chain(own.iter()).chain(with_pose.iter()).all(|entry| entry.is_finite());
        if !(is_sound && is_finite) {
            return;
        }
        self.errors.bias += by.x;
        self.errors.scale += by.y;
        self.own = Matrix2::new(own.m11, own.m12, own.m12, own.m22);
        self.with_pose = with_pose;
    }

    /// The square of the normalised innovation of a rate (rad/s) of a vehicle that stands, of that variance.
    #[must_use]
    pub fn test_rest(&self, rate: f64, variance: f64) -> f64 {
        let rest = rate - self.errors.bias;
        rest * rest / (self.own.m11 + variance)
    }

    /// The vehicle stands and the gyro tells that rate (rad/s), of that variance. The pose stays as it is: what it has in common
    /// with the bias shrinks (Schmidt's filter).
    pub fn see_rest(&mut self, rate: f64, variance: f64) {
        let sum = self.own.m11 + variance;
        if !(sum > 0.0 && sum.is_finite()) {
            return;
        }
        let gain = Vector2::new(self.own.m11, self.own.m12) / sum;
        let rest = rate - self.errors.bias;
        self.errors.bias += gain.x * rest;
        self.errors.scale += gain.y * rest;
        let bias_column = Vector3::new(self.with_pose.m11, self.with_pose.m21, self.with_pose.m31);
        self.with_pose -= bias_column * gain.transpose();
        let (bb, bs) = (self.own.m11, self.own.m12);
        let m12 = bs - gain.x * bs;
        self.own = Matrix2::new(
            (bb - gain.x * bb).max(LEAST_SHARE * LEAST_SHARE * self.priors.x),
            m12,
            m12,
            self.own.m22 - gain.y * bs,
        );
    }
}
