//! Which landmark an observation belongs to.

use serde::{Deserialize, Serialize};

use super::landmark_maps::MapViews;
use super::landmark_slots::LandmarkSlots;
use super::sighting::Sighting;
use super::slot_parameters::SlamParameters;
use crate::filter::{Ekf, Innovation, Landmark, Slots, Viewpoint};
use crate::geometry::{Point, difference};
use crate::maps::{self, LandmarkKind, NearestNeighbour, Verdict};
use crate::state::LandmarkSource;

/// Which maps correct the pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MapUse {
    /// The fixed map of reflectors.
    pub reflectors: bool,
    /// The fixed map of natural features.
    pub features: bool,
    /// The dynamic map of natural features (Algorithm 1 of K).
    pub dynamic: bool,
    /// Landmarks, calibration and past poses in the state of the filter; the dynamic map is then not used.
    pub slam: bool,
}

impl Default for MapUse {
    fn default() -> Self {
        Self { reflectors: true, features: true, dynamic: false, slam: false }
    }
}

/// Which observation belongs to which landmark.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AssociationParameters {
    /// Reflectors further than this from where one was seen are not considered, m.
    pub reflector_radius: f64,
    /// The same for natural features, m.
    pub feature_radius: f64,
    /// Largest squared Mahalanobis distance, chi-square with two degrees of freedom.
    pub gate: f64,
    /// By how much the second best landmark must be worse, in squared Mahalanobis distance.
    pub margin: f64,
    /// How many observations in a row share the error of a landmark's place in the map. The filter takes errors as
    /// independent; this multiplies the variance of the landmark, so that seeing one landmark often does not make its
    /// place certain.
    pub shared_map_error: f64,
}

impl Default for AssociationParameters {
    /// The gate lets 99.7 per cent of the right ones pass.
    fn default() -> Self {
        Self { reflector_radius: 1.5, feature_radius: 0.3, gate: 11.83, margin: 9.0, shared_map_error: 20.0 }
    }
}

/// What is believed of landmarks, and which of them are compared.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Believed<'a> {
    pub maps: MapUse,
    pub association: &'a AssociationParameters,
    /// Standard deviation of a landmark of the dynamic map along each axis, m.
    pub dynamic_deviation: f64,
    pub slam: &'a SlamParameters,
}

/// A landmark that an observation was compared with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    pub source: LandmarkSource,
    pub id: u16,
    pub landmark: Landmark,
    pub innovation: Innovation,
}

/// The nearest landmark and what it is good for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Association {
    pub verdict: Verdict,
    pub nearest: Option<Candidate>,
}

/// What is compared with the landmarks: something seen from a state of the filter.
pub(crate) struct Comparison<'a, S: Slots> {
    pub filter: &'a Ekf<S>,
    pub from: Viewpoint,
    pub seen: &'a Sighting,
    /// Where it is in W, m.
    pub located: Point,
    pub believed: Believed<'a>,
}

impl<'a, S: Slots> Comparison<'a, S> {
    pub fn new(filter: &'a Ekf<S>, seen: &'a Sighting, believed: Believed<'a>) -> Self {
        let from = filter.viewpoint(seen.laser, &seen.mount);
        let located = from.locate(&seen.observation.position());
        Self { filter, from, seen, located, believed }
    }

    /// Direction of what is seen in W, rad.
    pub fn orientation(&self) -> f32 {
        difference(f64::from(self.seen.orientation) + self.from.theta(), 0.0) as f32
    }

    fn radius(&self) -> f64 {
        let association = self.believed.association;
        match self.seen.kind {
            LandmarkKind::Reflector => association.reflector_radius,
            _ => association.feature_radius,
        }
    }

    fn candidate(&self, source: LandmarkSource, id: u16, landmark: Landmark) -> Option<Candidate> {
        let linearisation = self.filter.observe(&self.from, &self.seen.observation, &landmark)?;
        let innovation = self.filter.innovation(&linearisation)?;
        Some(Candidate { source, id, landmark, innovation })
    }

    /// The best of the candidates, if no other is nearly as good.
    fn decide(&self, candidates: impl Iterator<Item = Candidate>) -> Association {
        let association = self.believed.association;
        let mut nearest = NearestNeighbour::default();
        for candidate in candidates {
            let normalised_square = candidate.innovation.normalised_square;
            nearest.consider(candidate, normalised_square);
        }
        let (best, verdict) = nearest.decide(association.gate, association.margin);
        Association { verdict, nearest: best.map(|best| best.landmark) }
    }

    /// Compares it with the landmarks of the state, if there are `slots`, and with those that were given; and with those of the
    /// dynamic map only where none of them fits.
    pub fn associate(&self, maps: &MapViews<'_>, slots: Option<&LandmarkSlots<S>>) -> Association {
        let MapUse { reflectors, features, dynamic, .. } = self.believed.maps;
        let kind = self.seen.kind;
        let in_state = slots.map(|slots| self.in_state(slots));
        let given = |landmark: &maps::Landmark| {
            if slots.is_some_and(|slots| slots.has_fixed(landmark.id, landmark.kind)) {
                return None;
            }
            let deviation = f64::from(landmark.deviation);
            // A landmark that becomes part of the state is correlated with what it has told.
            let share = if slots.is_some() { 1.0 } else { self.believed.association.shared_map_error };
            let variance = share * deviation * deviation;
            let known = Landmark::Known { position: Point::new(landmark.x, landmark.y), variance };
            self.candidate(LandmarkSource::Fixed, landmark.id, known)
        };
        let in_state = in_state.into_iter().flatten();
        let radius = self.radius();
        if kind == LandmarkKind::Reflector {
            let near = reflectors.then(|| maps.reflectors.near(self.located, radius));
            return self.decide(in_state.chain(near.into_iter().flatten().filter_map(given)));
        }
        let near = features.then(|| maps.features.near(self.located, radius));
        let near = near.into_iter().flatten().filter(|landmark| landmark.kind == kind);
        let lasting = self.decide(in_state.chain(near.filter_map(given)));
        if !dynamic || slots.is_some() || lasting.verdict == Verdict::Accepted {
            return lasting;
        }
        let variance = self.believed.dynamic_deviation * self.believed.dynamic_deviation;
        let near = maps.dynamic.near(self.located, radius).filter(|landmark| landmark.kind == kind);
        let found = self.decide(near.filter_map(|landmark| {
            let known = Landmark::Known { position: landmark.position, variance };
            self.candidate(LandmarkSource::Dynamic, landmark.id, known)
        }));
        if found.nearest.is_some() { found } else { lasting }
    }

    /// Landmarks of the state that it may be.
    fn in_state(&self, slots: &LandmarkSlots<S>) -> impl Iterator<Item = Candidate> {
        let (radius, orientation) = (self.radius(), self.orientation());
        let is_near = move |slot: usize| {
            self.filter.landmark(slot).is_some_and(|position| {
                libm::fabs(position.x - self.located.x) <= radius && libm::fabs(position.y - self.located.y) <= radius
            })
        };
        slots.occupied().filter_map(move |(slot, landmark)| {
            let may_be = is_near(slot) && landmark.resembles(self.seen.kind, orientation, self.believed.slam);
            may_be.then(|| self.candidate(landmark.source, landmark.id, Landmark::Slot(slot))).flatten()
        })
    }
}
