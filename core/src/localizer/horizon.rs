//! With landmarks or past poses in the state the filter stands a little in the past: at the middle of what it has used last.

use super::{Capacities, Localizer};
use crate::geometry::Pose;
use crate::measurement::{LaserId, Scan, Time};
use crate::sources::{FindFeatures, LaserPlace};

impl<C: Capacities> Localizer<C> {
    /// Fuses the reflectors of the workspace that came without a scan.
    pub(super) fn fuse_lone_reflectors_by_slam(&mut self, mount: &Pose) {
        let sightings = &self.workspace.sightings;
        let (Some(first), Some(last)) = (sightings.first(), sightings.last()) else { return };
        let (start, end) = (first.time, last.time);
        let Some(timeline) = self.timeline.begun() else { return };
        self.workspace.path.set(start, mount, timeline.relative_path(start, end));
        self.fuse_reflectors_by_slam(start);
    }

    /// Fuses the reflectors of the workspace, whose path begins at `start`, all at the time of the one in the middle.
    pub(super) fn fuse_reflectors_by_slam(&mut self, start: Time) {
        let sightings = &self.workspace.sightings;
        let (Some(first), Some(last)) = (sightings.first(), sightings.last()) else { return };
        let end = last.time;
        let time = first.time.offset(0.5 * end.since(first.time));
        if self.begin_slam(time, end) {
            self.fuse(start);
            self.slam.finish(true, &self.parameters.slam);
            self.end_slam();
        }
    }

    /// Fuses the natural features of a scan, and the scan itself, at the time of its middle.
    pub(super) fn fuse_scan_by_slam(&mut self, mount: &Pose, scan: &Scan) {
        // Where contours of the way behind tell the pose, only features that were given beforehand are compared with the scan.
        if self.parameters.maps.features || !self.uses_contours_behind() {
            self.find_features(mount, scan);
        } else {
            self.workspace.sightings.clear();
        }
        if !self.begin_slam(scan.beam_time(scan.ranges.len() / 2), scan.end()) {
            return;
        }
        if !self.slam.wants_scan(&self.parameters.slam) {
            return;
        }
        let place = self.workspace.path.place(self.slam.time().since(scan.start));
        if self.uses_contours() {
            self.fuse_contours_by_slam(mount, &place, scan.laser);
        }
        // What lies behind is seen by the first laser.
        let is_first = scan.laser == LaserId::FIRST;
        let behind =
            (is_first && self.uses_contours_behind()).then_some(LaserPlace { in_points: place, mount: *mount });
        if let Some(laser) = behind {
            self.fuse_contours_behind(laser);
        }
        let is_aligned = is_first && behind.is_none() && self.parameters.sources.key_scans;
        if is_aligned {
            let status = &mut self.outputs.sources.key_scans;
            status.begin(self.slam.time());
            self.slam.align(self.features.points(), &place, &self.parameters, status);
        }
        self.fuse(scan.start);
        self.slam.finish(false, &self.parameters.slam);
        if let Some(laser) = &behind {
            self.keep_contours_behind(laser);
        }
        if is_aligned {
            self.slam.keep(self.features.points(), &place, &self.parameters);
        }
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

    fn end_slam(&mut self) {
        // The filter's time is one that the timeline reaches: see `begin_slam`.
        let _ = self.timeline.set_state(self.slam.time(), self.slam.state());
    }
}
