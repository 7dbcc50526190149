//! A pose that is told as a whole, as by surfaces that a scan is laid onto.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::cholesky::Root;
use super::{Ekf, Linearisation, Slots};
use crate::geometry::{Pose, difference};

/// A pose of R in W as somebody has seen it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseObservation {
    /// The pose.
    pub pose: Pose,
    /// Its covariance as outputs state it: xx, xy, yy (m^2), x heading, y heading (m rad), heading (rad^2).
    pub covariance: [f64; 6],
    /// What of the variances of x and y (m^2) and heading (rad^2) are errors that other such observations have too: seeing it
    /// again and again makes none of them smaller.
    pub shared: [f64; 3],
    /// By what the covariance of the pose is multiplied before it is corrected, as the odometry has been wrong by more than it may be: 1 or
    /// more.
    pub widening: f64,
}

impl PoseObservation {
    /// The covariance as a matrix.
    #[must_use]
    pub const fn covariance_matrix(&self) -> Matrix3<f64> {
        let [xx, xy, yy, x_heading, y_heading, heading] = self.covariance;
        Matrix3::new(xx, xy, x_heading, xy, yy, y_heading, x_heading, y_heading, heading)
    }

    /// How far it is from the pose of a state.
    #[must_use]
    pub fn linearise<S: Slots>(&self, state: &Ekf<S>) -> Linearisation<3> {
        let residual = Vector3::new(
            self.pose.x - state.pose.x,
            self.pose.y - state.pose.y,
            difference(self.pose.theta, state.pose.theta),
        );
        Linearisation::new(residual, self.covariance_matrix())
            .with(0, Vector3::x())
            .with(1, Vector3::y())
            .with(2, Vector3::z())
    }

    /// Its squared Mahalanobis distance from the pose of a state: chi-square with three degrees of freedom. None if the covariance is
    /// singular.
    #[must_use]
    pub fn normalised_square<S: Slots>(&self, state: &Ekf<S>) -> Option<f64> {
        let linearisation = self.linearise(state);
        let root = Root::of(&state.residual_covariance(&linearisation))?;
        Some(root.whiten(&linearisation.residual).norm_squared()).filter(|square| square.is_finite())
    }

    /// Corrects a state. No variance of its pose becomes less than what the observation shares with others, unless it was.
    /// False, and nothing changed, if the filter refuses it as singular.
    pub fn apply<S: Slots>(&self, state: &mut Ekf<S>) -> bool {
        state.widen_pose(self.widening);
        let before = state.pose_variances();
        if !state.correct(&self.linearise(state)) {
            return false;
        }
        let [x, y, heading] = self.shared;
        state.raise_pose_variances([before[0].min(x), before[1].min(y), before[2].min(heading)]);
        true
    }
}
