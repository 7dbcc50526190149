//! Fusing what is seen, each sighting at its own time or all at the filter's.

use super::evidence::Evidence;
use super::{Capacities, Localizer, Parameters};
use crate::geometry::Pose;
use crate::maps::{LandmarkKind, Verdict};
use crate::measurement::{Scan, Time};
use crate::sources::{FindFeatures, LandmarkMaps, MapViews, Outcome, correct};
use crate::state::LandmarkSource;

impl<C: Capacities> Localizer<C> {
    /// Fuses the sightings of the workspace: each at its own time, or, with landmarks in the state, all at the time of the
    /// filter, moved there by the path of the workspace, which begins at `start`.
    pub(super) fn fuse(&mut self, start: Time) {
        let Some(timeline) = self.timeline.begun_mut().filter(|_| self.lost.is_none()) else {
            return;
        };
        let believed = self.parameters.believed();
        let maps = MapViews {
            reflectors: self.maps.reflectors(),
            features: self.maps.features(),
            dynamic: self.maps.dynamic(),
        };
        let has_slots = believed.maps.slam;
        // A vehicle whose map has none knows of none, or finds them on its way.
        let are_reflectors_expected = !maps.reflectors.landmarks().is_empty();
        let gate = believed.association.gate;
        let mut evidence = Evidence::new(&mut self.outputs, &mut self.distance, gate, are_reflectors_expected);
        for sighting in &mut self.workspace.sightings {
            let outcome = if has_slots {
                let moved = sighting.moved(&self.workspace.path, start, self.slam.time());
                let (filter, slots) = self.slam.parts();
                correct(filter, Some(slots), &maps, &moved, believed).0
            } else {
                let mut outcome = Outcome::OUT_OF_TIME;
                // What finds no place in the past is out of time.
                let _ = timeline.fuse(sighting.time, |state| {
                    let correction;
                    (outcome, correction) = correct(state, None, &maps, sighting, believed);
                    correction
                });
                outcome
            };
            sighting.verdict = outcome.verdict;
            sighting.matched = match outcome.landmark {
                Some((LandmarkSource::Dynamic, id, _)) if outcome.is_used => Some(id),
                _ => None,
            };
            evidence.add(sighting, &outcome);
        }
        self.lost = evidence.judge(&mut self.integrity.innovations);
        if has_slots {
            self.discover(start, are_reflectors_expected);
        }
    }

    /// Finds the natural features of a scan.
    pub(super) fn find_features(&mut self, mount: &Pose, scan: &Scan) {
        let Parameters { features, sources, .. } = &self.parameters;
        self.outputs.has_cut |= self.features.find(&mut self.workspace, features, sources, mount, scan);
    }

    /// Tells that the sightings of the workspace are neither for nor against the pose.
    pub(super) fn refuse_sightings(&mut self) {
        let gate = self.parameters.association.gate;
        let mut evidence = Evidence::new(&mut self.outputs, &mut self.distance, gate, true);
        for sighting in &mut self.workspace.sightings {
            sighting.verdict = Outcome::OUT_OF_TIME.verdict;
            evidence.add(sighting, &Outcome::OUT_OF_TIME);
        }
    }

    /// Takes what fits no landmark as new ones of the state, once all that was seen has corrected the pose.
    fn discover(&mut self, start: Time, are_reflectors_given: bool) {
        let are_features_wanted = !self.uses_contours_behind();
        for sighting in &self.workspace.sightings {
            let is_reflector = sighting.kind == LandmarkKind::Reflector;
            let may_be_new = if is_reflector { !are_reflectors_given } else { are_features_wanted };
            if may_be_new && matches!(sighting.verdict, Verdict::Unknown | Verdict::Gated) {
                let moved = sighting.moved(&self.workspace.path, start, self.slam.time());
                self.slam.discover(&moved, self.parameters.believed());
            }
        }
    }

    /// Algorithm 1 (K 5.4.1) for the natural features of one scan, at the poses that the whole scan has led to. A vehicle
    /// that is lost does not know where they are.
    pub(super) fn update_dynamic_map(&mut self) {
        let is_wanted = self.parameters.maps.dynamic && self.lost.is_none();
        let Some(timeline) = self.timeline.begun_mut().filter(|_| is_wanted) else {
            return;
        };
        self.maps.find(self.workspace.sightings.iter().filter_map(|sighting| {
            if sighting.matched.is_none() && !matches!(sighting.verdict, Verdict::Unknown | Verdict::Gated) {
                return None;
            }
            let state = timeline.state_at(sighting.time).ok()?;
            Some((sighting.kind, sighting.observation.locate(&state.pose, &sighting.mount), sighting.matched))
        }));
    }
}
