//! What the sightings of one event say of the pose.

use serde::{Deserialize, Serialize};

use super::{LandmarkUse, Outputs, Reason};
use crate::integrity::InnovationMonitor;
use crate::maps::{LandmarkKind, Verdict};
use crate::sources::{Outcome, Sighting, Source};
use crate::state::LandmarkSource;

/// Distance since something last happened, m.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct DistanceSince {
    pub reflector: f64,
    pub feature: f64,
    pub fix: f64,
}

impl DistanceSince {
    pub const NEVER: Self = Self { reflector: f64::INFINITY, feature: f64::INFINITY, fix: f64::INFINITY };

    pub fn any(&self) -> f64 {
        self.reflector.min(self.feature).min(self.fix)
    }

    pub fn advance(&mut self, distance: f64) {
        self.reflector += distance;
        self.feature += distance;
        self.fix += distance;
    }
}

/// Counts what the sightings of one event say, and tells it in the outputs.
pub(super) struct Evidence<'a> {
    outputs: &'a mut Outputs,
    distance: &'a mut DistanceSince,
    gate: f64,
    /// Whether a reflector must belong to a landmark.
    are_reflectors_expected: bool,
    expected: usize,
    accepted: usize,
    used: usize,
    square_sum: f64,
}

impl<'a> Evidence<'a> {
    pub fn new(
        outputs: &'a mut Outputs,
        distance: &'a mut DistanceSince,
        gate: f64,
        are_reflectors_expected: bool,
    ) -> Self {
        Self { outputs, distance, gate, are_reflectors_expected, expected: 0, accepted: 0, used: 0, square_sum: 0.0 }
    }

    /// Takes one sighting and what became of it.
    pub fn add(&mut self, sighting: &Sighting, outcome: &Outcome) {
        let is_accepted = outcome.is_used;
        let is_fixed = outcome.landmark.is_none_or(|(source, ..)| source == LandmarkSource::Fixed);
        let is_reflector = sighting.kind == LandmarkKind::Reflector;
        // Two landmarks that fit equally say nothing against the pose, nor does a feature that no map has.
        let is_evidence = is_fixed
            && !matches!(outcome.verdict, Verdict::Ambiguous | Verdict::OutOfTime)
            && ((is_reflector && self.are_reflectors_expected) || outcome.landmark.is_some());
        if is_evidence {
            self.expected += 1;
            self.accepted += usize::from(is_accepted);
        }
        if let Some((_, _, innovation)) = outcome.landmark.filter(|_| is_accepted) {
            self.used += 1;
            self.square_sum += innovation.normalised_square;
            if is_reflector {
                self.distance.reflector = 0.0;
            } else {
                self.distance.feature = 0.0;
            }
        }
        let test_ratio = outcome.landmark.map(|(_, _, innovation)| innovation.normalised_square / self.gate);
        let status = self.outputs.sources.of_mut(Source::of_landmark(sighting.kind));
        status.add(sighting.time, outcome.verdict, is_accepted, test_ratio);
        let position = sighting.observation.position();
        let innovation = outcome.landmark.map(|(_, _, innovation)| innovation);
        let is_told = self.outputs.uses.push(LandmarkUse {
            time: sighting.time,
            laser: sighting.laser,
            kind: sighting.kind,
            landmark: outcome.landmark.map(|(source, id, _)| (source, id)),
            verdict: outcome.verdict,
            position: [position.x as f32, position.y as f32],
            located: outcome.located.into(),
            residual: innovation.map_or([0.0; 2], |innovation| innovation.residual.into()),
            residual_deviation: innovation.map_or([0.0; 2], |innovation| {
                [libm::sqrt(innovation.covariance.m11), libm::sqrt(innovation.covariance.m22)]
            }),
            test_ratio: test_ratio.unwrap_or(0.0),
        });
        self.outputs.has_cut |= is_told.is_err();
    }

    /// Adds the event to the evidence of those before, and says why the vehicle is lost if they are against the pose.
    pub fn judge(self, consistency: &mut InnovationMonitor) -> Option<Reason> {
        consistency.add(self.expected, self.accepted, self.used, self.square_sum);
        if consistency.is_rejecting() {
            Some(Reason::LandmarksRejected)
        } else if consistency.has_large_innovations() {
            Some(Reason::InnovationsTooLarge)
        } else {
            None
        }
    }
}
