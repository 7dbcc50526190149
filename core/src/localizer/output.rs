//! What the localiser says.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::{Mode, Reason};
use crate::geometry::Pose;
use crate::landmarks::{LandmarkKind, Verdict};
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

/// From which map a landmark is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LandmarkSource {
    /// Given beforehand.
    Fixed,
    /// Found while driving.
    Dynamic,
}

/// What became of one observation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LandmarkUse {
    /// When it was true.
    pub time: Time,
    /// What was seen.
    pub kind: LandmarkKind,
    /// The nearest landmark, if there is one near.
    pub landmark: Option<(LandmarkSource, u16)>,
    /// Verdict.
    pub verdict: Verdict,
    /// Where it was seen in S, m.
    pub position: [f32; 2],
    /// Where that is in W, from the pose at its time before this observation was used, m.
    pub located: [f64; 2],
    /// Observation minus expectation for the nearest landmark; m and rad, or m and m.
    pub residual: [f64; 2],
    /// Standard deviation that the filter expects of the residual, in its units; zero without a landmark.
    pub residual_deviation: [f64; 2],
    /// Squared Mahalanobis distance to the nearest landmark, divided by the gate: below one is inside.
    pub test_ratio: f64,
}

/// Observations of one event at the most.
pub(super) const OBSERVATIONS: usize = 128;

/// Everything that one event gave.
#[derive(Clone, Debug)]
pub struct Outputs {
    /// The pose after the event.
    pub pose: PoseOutput,
    /// What became of the event's observations, in order of time.
    pub uses: Vec<LandmarkUse, OBSERVATIONS>,
}
