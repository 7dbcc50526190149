//! Fusing what is seen into the filter with landmarks and past poses, a scan at a time.

use super::Localizer;
use super::evidence::{Evidence, Fate};
use super::slam::{Seen, cartesian};
use crate::geometry::Point;
use crate::maps::{LandmarkKind, Verdict};
use crate::measurement::{Scan, Time};

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
    /// Fuses the reflectors of the workspace that came without a scan.
    pub(super) fn fuse_lone_reflectors_by_slam(&mut self) {
        let sightings = &self.workspace.sightings;
        let (Some(first), Some(last)) = (sightings.first(), sightings.last()) else { return };
        let (start, end) = (first.time, last.time);
        let Some(timeline) = self.timeline.begun() else { return };
        self.workspace.path.set(start, &self.parameters.laser, timeline.relative_path(start, end));
        self.fuse_reflectors_by_slam(start);
    }

    /// Fuses the reflectors of the workspace, whose path begins at `start`, all at the time of the one in the middle.
    pub(super) fn fuse_reflectors_by_slam(&mut self, start: Time) {
        let sightings = &self.workspace.sightings;
        let (Some(first), Some(last)) = (sightings.first(), sightings.last()) else { return };
        let end = last.time;
        let time = first.time.offset(0.5 * end.since(first.time));
        if self.begin_slam(time, end) {
            self.fuse_by_slam(start);
            self.slam.finish(true, &self.parameters.slam);
            self.end_slam();
        }
    }

    /// Fuses the natural features of a scan, and the scan itself, at the time of its middle.
    pub(super) fn fuse_scan_by_slam(&mut self, scan: &Scan) {
        self.outputs.has_cut |= self.workspace.see_features(&self.parameters, scan);
        if !self.begin_slam(scan.beam_time(scan.ranges.len() / 2), scan.end()) {
            return;
        }
        if !self.slam.wants_scan(&self.parameters.slam) {
            return;
        }
        let place = self.workspace.path.place(self.slam.time().since(scan.start));
        self.slam.align(&self.workspace.points, &place, &self.parameters);
        self.fuse_by_slam(scan.start);
        self.slam.finish(false, &self.parameters.slam);
        self.slam.keep(&self.workspace.points, &place, &self.parameters);
        self.end_slam();
    }

    /// Brings the filter to `time`, or where it is if that is later, but not beyond `latest`. False if it cannot be there;
    /// the sightings of the workspace are then told to be out of time.
    fn begin_slam(&mut self, time: Time, latest: Time) -> bool {
        let Some(timeline) = self.timeline.begun().filter(|_| self.lost.is_none()) else { return false };
        if self.slam.time() > latest || timeline.reaches(time.max(self.slam.time())).is_err() {
            self.refuse_sightings();
            return false;
        }
        self.slam.advance(time, timeline, &self.parameters);
        true
    }

    /// Tells that the sightings of the workspace are neither for nor against the pose.
    fn refuse_sightings(&mut self) {
        let gate = self.parameters.association.gate;
        let mut evidence = Evidence::new(&mut self.outputs, &mut self.distance, gate, true);
        let fate = Fate { verdict: Verdict::OutOfTime, landmark: None, located: Point::default() };
        for sighting in &mut self.workspace.sightings {
            sighting.verdict = fate.verdict;
            evidence.add(sighting, &fate, false);
        }
    }

    fn end_slam(&mut self) {
        // The filter's time is one that the timeline reaches: see `begin_slam`.
        let _ = self.timeline.set_state(self.slam.time(), self.slam.state());
    }

    /// Fuses the sightings of the workspace at the filter's time; its path begins at `start`.
    fn fuse_by_slam(&mut self, start: Time) {
        // A vehicle without a map of reflectors finds them on its way.
        let reflectors_are_given = !self.maps.reflectors.landmarks().is_empty();
        let gate = self.parameters.association.gate;
        let mut evidence = Evidence::new(&mut self.outputs, &mut self.distance, gate, reflectors_are_given);
        let now = self.slam.time().since(start);
        let path = &self.workspace.path;
        for sighting in &mut self.workspace.sightings {
            let mut seen = cartesian(&sighting.observation);
            seen.position = path.from_start(now, &path.to_start(sighting.time.since(start), &seen.position));
            let seen = Seen { kind: sighting.kind, cartesian: seen, orientation: sighting.orientation };
            let fate = self.slam.see(&seen, &self.maps, &self.parameters);
            sighting.verdict = fate.verdict;
            evidence.add(sighting, &fate, fate.verdict == Verdict::Accepted);
        }
        let lost = evidence.judge(&mut self.integrity.innovations);
        // What fits no landmark is new, once the whole scan has corrected the pose.
        for sighting in &self.workspace.sightings {
            let may_be_new = sighting.kind != LandmarkKind::Reflector || !reflectors_are_given;
            if may_be_new && matches!(sighting.verdict, Verdict::Unknown | Verdict::Gated) {
                let mut seen = cartesian(&sighting.observation);
                seen.position = path.from_start(now, &path.to_start(sighting.time.since(start), &seen.position));
                let seen = Seen { kind: sighting.kind, cartesian: seen, orientation: sighting.orientation };
                self.slam.discover(&seen, &self.parameters);
            }
        }
        self.lost = lost;
    }
}
