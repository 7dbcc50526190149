//! The maps that the localiser compares its observations with.

use super::{LandmarkSource, MapUse, Parameters};
use crate::filter::{Correction, Ekf, Innovation, Observation};
use crate::geometry::Point;
use crate::maps::{DynamicMap, FixedMap, LandmarkKind, NearestNeighbour, Verdict};

/// The fixed maps and the dynamic one.
#[derive(Clone, Debug)]
pub(super) struct Maps<const REFLECTORS: usize, const FEATURES: usize, const DYNAMIC: usize> {
    pub(super) reflectors: FixedMap<REFLECTORS>,
    pub(super) features: FixedMap<FEATURES>,
    pub(super) dynamic: DynamicMap<DYNAMIC>,
}

/// A landmark that an observation was compared with.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub(super) source: LandmarkSource,
    pub(super) id: u16,
    pub(super) position: Point,
    pub(super) variance: f64,
    pub(super) innovation: Innovation,
}

/// The nearest landmark and what it is good for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Association {
    pub(super) verdict: Verdict,
    pub(super) nearest: Option<Candidate>,
}

impl Association {
    pub(super) const NONE: Self = Self { verdict: Verdict::Unknown, nearest: None };

    /// The correction that follows from the association, if it was accepted.
    pub(super) fn correction(&self, observation: &Observation) -> Option<Correction> {
        let landmark = self.nearest.filter(|_| self.verdict == Verdict::Accepted)?;
        Some(Correction {
            observation: *observation,
            landmark: landmark.position,
            landmark_variance: landmark.variance,
        })
    }
}

impl<const REFLECTORS: usize, const FEATURES: usize, const DYNAMIC: usize> Maps<REFLECTORS, FEATURES, DYNAMIC> {
    /// Compares an observation with the maps that are in use: fixed landmarks first, and those that were found while
    /// driving only where no fixed one fits.
    pub(super) fn associate(
        &self,
        parameters: &Parameters,
        state: &Ekf,
        kind: LandmarkKind,
        observation: &Observation,
    ) -> Association {
        let MapUse { reflectors, features, dynamic, .. } = parameters.maps;
        let seen = observation.locate(&state.pose, &parameters.laser);
        let association = &parameters.association;
        let compare = |source, id, position: Point, variance: f64| -> Option<Candidate> {
            let linearisation = observation.linearise(&state.pose, &parameters.laser, &position, variance)?;
            let innovation = state.innovation(&linearisation)?;
            Some(Candidate { source, id, position, variance, innovation })
        };
        let decide = |candidates: &mut dyn Iterator<Item = Candidate>| {
            let mut nearest = NearestNeighbour::default();
            for candidate in candidates {
                nearest.consider(candidate, candidate.innovation.normalised_square);
            }
            let (best, verdict) = nearest.decide(association.gate, association.margin);
            Association { verdict, nearest: best.map(|best| best.landmark) }
        };
        let fixed = |landmark: &crate::maps::Landmark| {
            let deviation = f64::from(landmark.deviation);
            let variance = association.shared_map_error * deviation * deviation;
            compare(LandmarkSource::Fixed, landmark.id, Point::new(landmark.x, landmark.y), variance)
        };
        if kind == LandmarkKind::Reflector {
            return if reflectors {
                decide(&mut self.reflectors.near(seen, association.reflector_radius).filter_map(fixed))
            } else {
                Association::NONE
            };
        }
        let radius = association.feature_radius;
        let of_fixed = if features {
            let near = self.features.near(seen, radius).filter(|landmark| landmark.kind == kind);
            decide(&mut near.filter_map(fixed))
        } else {
            Association::NONE
        };
        if !dynamic || of_fixed.verdict == Verdict::Accepted {
            return of_fixed;
        }
        let variance = parameters.dynamic_map.deviation * parameters.dynamic_map.deviation;
        let near = self.dynamic.near(seen, radius).filter(|landmark| landmark.kind == kind);
        let of_dynamic = decide(
            &mut near.filter_map(|landmark| compare(LandmarkSource::Dynamic, landmark.id, landmark.position, variance)),
        );
        if of_dynamic.nearest.is_some() { of_dynamic } else { of_fixed }
    }
}
