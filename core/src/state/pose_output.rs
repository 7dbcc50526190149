//! The pose with its truth.

use serde::{Deserialize, Serialize};

use super::{Mode, Reason};
use crate::geometry::Pose;
use crate::measurement::Time;

/// The pose with its truth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseOutput {
    /// When the pose is true: the latest time that any event spoke of.
    pub time: Time,
    /// Pose of R in W.
    pub pose: Pose,
    /// Covariance in W: xx, xy, yy (m^2), x heading, y heading (m rad), heading (rad^2).
    pub covariance: [f64; 6],
    /// What the pose rests on.
    pub mode: Mode,
    /// Why.
    pub reason: Reason,
    /// Way since a landmark last corrected the pose, m.
    pub dead_reckoning_distance: f64,
    /// Share of the observations of fixed landmarks that were accepted lately, 0 to 1.
    pub acceptance: f64,
    /// Mean normalised squared innovation of the accepted observations lately; 2 is expected.
    pub normalised_square: f64,
}
