//! What became of a source.

use serde::{Deserialize, Serialize};

use crate::maps::Verdict;
use crate::measurement::Time;

/// What became of a source, in the last event in which it told something. Counts are of observations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SourceStatus {
    /// When it last told something; none if it never has.
    pub told: Option<Time>,
    /// When it last corrected the pose; none if it never has.
    pub used: Option<Time>,
    /// How many observations there were.
    pub observations: u16,
    /// How many of them have corrected the pose.
    pub accepted: u16,
    /// How many were further from what was expected than the gate lets pass.
    pub gated: u16,
    /// Mean of the squared Mahalanobis distances over the gate, of those that were compared with something: below one is
    /// inside.
    pub test_ratio: f32,
    compared: u16,
}

impl SourceStatus {
    /// Begins an event in which it tells something, true at `time`.
    pub(crate) fn begin(&mut self, time: Time) {
        *self = Self { told: Some(time), used: self.used, ..Self::default() };
    }

    /// Takes one observation that was true at `time`; `test_ratio` is its squared Mahalanobis distance over the gate, if it was
    /// compared with something.
    pub(crate) fn add(&mut self, time: Time, verdict: Verdict, is_used: bool, test_ratio: Option<f64>) {
        self.observations = self.observations.saturating_add(1);
        self.gated = self.gated.saturating_add(u16::from(verdict == Verdict::Gated));
        if is_used {
            self.accepted = self.accepted.saturating_add(1);
            self.used = Some(time);
        }
        if let Some(ratio) = test_ratio {
            self.compared = self.compared.saturating_add(1);
            self.test_ratio += (ratio as f32 - self.test_ratio) / f32::from(self.compared);
        }
    }
}
