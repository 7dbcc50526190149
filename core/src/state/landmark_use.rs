//! What became of an observation.

use serde::{Deserialize, Serialize};

use crate::maps::{LandmarkKind, Verdict};
use crate::measurement::{LaserId, Time};

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
    /// Which laser has seen it.
    pub laser: LaserId,
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
