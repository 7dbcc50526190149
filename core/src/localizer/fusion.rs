//! Fusing what is seen, each sighting at its own time.

use super::evidence::{Evidence, Fate};
use super::maps::Association;
use super::{LandmarkSource, Localizer};
use crate::geometry::Point;
use crate::maps::Verdict;

impl<
    const BEAMS: usize,
    const REFLECTORS: usize,
    const FEATURES: usize,
    const DYNAMIC: usize,
    const KEYS: usize,
    const LANDMARKS: usize,
    const STATES: usize,
    const ENTRIES: usize,
> Localizer<BEAMS, REFLECTORS, FEATURES, DYNAMIC, KEYS, LANDMARKS, STATES, ENTRIES>
{
    /// Fuses the sightings of the workspace, each at its own time, and brings the dynamic map up to date.
    pub(super) fn fuse(&mut self) {
        let Some(timeline) = self.timeline.begun_mut().filter(|_| self.lost.is_none()) else {
            return;
        };
        let gate = self.parameters.association.gate;
        let mut evidence = Evidence::new(&mut self.outputs, &mut self.distance, gate, true);
        for sighting in &mut self.workspace.sightings {
            let mut association = Association::NONE;
            let mut located = Point::default();
            let outcome = timeline.correct(sighting.time, |state| {
                located = sighting.observation.locate(&state.pose, &self.parameters.laser);
                association = self.maps.associate(&self.parameters, state, sighting.kind, &sighting.observation);
                association.correction(&sighting.observation)
            });
            if outcome.is_err() {
                association.verdict = Verdict::OutOfTime;
            }
            let is_accepted = outcome == Ok(true);
            sighting.verdict = association.verdict;
            sighting.matched = association
                .nearest
                .filter(|landmark| is_accepted && landmark.source == LandmarkSource::Dynamic)
                .map(|landmark| landmark.id);
            let landmark = association.nearest.map(|landmark| (landmark.source, landmark.id, landmark.innovation));
            let fate = Fate { verdict: association.verdict, landmark, located };
            evidence.add(sighting, &fate, is_accepted);
        }
        self.lost = evidence.judge(&mut self.integrity.innovations);
    }

    /// Algorithm 1 (K 5.4.1) for the natural features of one scan, at the poses that the whole scan has led to. A vehicle
    /// that is lost does not know where they are.
    pub(super) fn update_dynamic_map(&mut self) {
        let is_wanted = self.parameters.maps.dynamic && self.lost.is_none();
        let Some(timeline) = self.timeline.begun_mut().filter(|_| is_wanted) else {
            return;
        };
        for sighting in &self.workspace.sightings {
            let Ok(state) = timeline.state_at(sighting.time) else {
                continue;
            };
            let position = sighting.observation.locate(&state.pose, &self.parameters.laser);
            match (sighting.matched, sighting.verdict) {
                (Some(id), _) => self.maps.dynamic.update(id, position),
                (None, Verdict::Unknown | Verdict::Gated) => self.maps.dynamic.insert(sighting.kind, position),
                _ => {}
            }
        }
        self.maps.dynamic.finish();
    }
}
