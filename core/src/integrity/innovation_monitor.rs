//! Whether what the filter believes fits what it sees.

use serde::{Deserialize, Serialize};

/// When the evidence is against the pose.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct InnovationMonitorParameters {
    /// How many observations the evidence reaches back, at least one.
    pub memory: f64,
    /// How much of the evidence remains at least after each scan, 0 to 1: however many observations it has, one scan
    /// alone decides nothing.
    pub least_remaining: f64,
    /// Least weight of remembered observations for a verdict.
    pub least_observations: f64,
    /// Least share of observations of the fixed map that must have been accepted.
    pub least_acceptance: f64,
    /// Largest mean of the accepted observations' normalised squared innovation; 2 is expected.
    pub largest_normalised_square: f64,
}

impl Default for InnovationMonitorParameters {
    fn default() -> Self {
        Self {
            memory: 10.0,
            least_remaining: 0.7,
            least_observations: 5.0,
            least_acceptance: 0.4,
            largest_normalised_square: 5.0,
        }
    }
}

/// Evidence of the last scans, with exponential forgetting.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct InnovationMonitor {
    parameters: InnovationMonitorParameters,
    expected: f64,
    accepted: f64,
    used: f64,
    normalised_square: f64,
    /// The same as `expected` and `accepted` with the longer memory.
    steady: [f64; 2],
    /// Scans with evidence so far, as many as matter.
    scans: f64,
}

/// How many scans the longer memory of the acceptance reaches back.
const STEADY: f64 = 12.0;
/// Below this share of accepted landmarks the map may be another one that looks alike; a new pose must do better by so much,
/// until it has stood the test of so many scans.
const DOUBTFUL: f64 = 0.75;
const PROBATION: f64 = 0.13;
const PROBATION_SCANS: f64 = 24.0;
/// One alone that fits nothing may be a false reflector, however few have been seen; so many, weighted, are more than one.
const MORE_THAN_ONE: f64 = 1.25;

impl InnovationMonitor {
    /// No evidence yet.
    #[must_use]
    pub fn new(parameters: InnovationMonitorParameters) -> Self {
        Self {
            parameters,
            expected: 0.0,
            accepted: 0.0,
            used: 0.0,
            normalised_square: 0.0,
            steady: [0.0; 2],
            scans: 0.0,
        }
    }

    /// Takes the evidence of one scan: how many observations tell whether they fit a fixed landmark, how many of these
    /// were accepted, and of all that were used their number and the sum of their normalised squared innovations.
    pub fn add(&mut self, expected: usize, accepted: usize, used: usize, normalised_square_sum: f64) {
        let remaining = self.remaining(expected);
        self.expected = remaining * self.expected + expected as f64;
        self.accepted = remaining * self.accepted + accepted as f64;
        if expected > 0 {
            let [before, accepted_before] = self.steady.map(|sum| sum * (1.0 - 1.0 / STEADY));
            self.scans = (self.scans + 1.0).min(PROBATION_SCANS);
            self.steady = [before + expected as f64, accepted_before + accepted as f64];
        }
        let remaining = self.remaining(used);
        self.used = remaining * self.used + used as f64;
        self.normalised_square = remaining * self.normalised_square + normalised_square_sum;
    }

    /// How much of the older evidence remains after that many observations.
    fn remaining(&self, observations: usize) -> f64 {
        let each = 1.0 - 1.0 / self.parameters.memory.max(1.0);
        libm::pow(each, observations as f64).max(self.parameters.least_remaining)
    }

    /// Share of the observations of the fixed map that were accepted; one if there are none.
    #[must_use]
    pub fn acceptance(&self) -> f64 {
        if self.expected > 0.0 { self.accepted / self.expected } else { 1.0 }
    }

    /// Whether the map may be another one that looks alike: such a map fits well now and then, so a few scans and some more
    /// of them must both fit, but for one observation. One scan alone says nothing.
    #[must_use]
    pub fn is_doubtful(&self) -> bool {
        let [expected, accepted] = self.steady;
        let steady = if expected > 0.0 { accepted / expected } else { 1.0 };
        let least = DOUBTFUL + PROBATION * (1.0 - self.scans / PROBATION_SCANS);
        let has_more_than_one = self.scans > 1.0 && expected - accepted > MORE_THAN_ONE;
        has_more_than_one && self.acceptance().min(steady) < least
    }

    /// Mean normalised squared innovation of what was used; two if nothing was.
    #[must_use]
    pub fn mean_normalised_square(&self) -> f64 {
        if self.used > 0.0 { self.normalised_square / self.used } else { 2.0 }
    }

    /// Whether most observations fit no landmark.
    #[must_use]
    pub fn is_rejecting(&self) -> bool {
        self.expected >= self.parameters.least_observations && self.acceptance() < self.parameters.least_acceptance
    }

    /// Whether the innovations are larger than the filter believes.
    #[must_use]
    pub fn has_large_innovations(&self) -> bool {
        self.used >= self.parameters.least_observations
            && self.mean_normalised_square() > self.parameters.largest_normalised_square
    }
}
