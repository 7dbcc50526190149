//! Correcting the pose by the contours of a kept map: a scan is used as a whole, at the time of its middle.

use super::{Capacities, ContourSearch, Event, Localizer};
use crate::contours::KeptMapError;
use crate::filter::{Ekf, PoseObservation};
use crate::geometry::Pose;
use crate::maps::{MapView, Verdict};
use crate::measurement::{LaserId, Scan, Time};
use crate::sources::{
    ContourOutcome, FindContours, FindFeatures, LandmarkMaps, LaserAtStart, LaserPlace, LendContours, ScanBehind,
    see_contours,
};
use crate::state::{LandmarkSource, LandmarkUse};

/// While reflectors have the position as well as this, m, contours do not correct it.
const BY_REFLECTORS: f64 = 0.02;

/// As far behind a reflector that has corrected the pose, m, as those seen since agree with it, contours of the way behind correct no
/// odometry by a match that surprises.
const LED_BEHIND: f64 = 2.0;

/// What contours have done to the pose in the present event.
#[derive(Clone, Copy, Debug)]
pub(super) enum ContourCorrection {
    /// Nothing.
    None,
    /// They may have moved it.
    Applied,
    /// They may have moved it, and the solutions behind the protection level are told what was seen, and when.
    Told { time: Time, seen: PoseObservation },
}

impl<'m, C: Capacities> Localizer<C>
where
    C::Contours: LendContours<'m>,
{
    /// Takes bytes as the map of contours instead of the one before, also while the vehicle drives. They stay where they are.
    ///
    /// # Errors
    /// See [`KeptMapError`]; the map is as before then.
    pub fn lend_contours(&mut self, bytes: &'m [u8]) -> Result<(), KeptMapError> {
        self.contours.lend(bytes)?;
        self.begin_other_contours();
        Ok(())
    }
}

impl<C: Capacities> Localizer<C> {
    /// Takes another map of contours, or none; also while the vehicle drives.
    pub fn set_contours(&mut self, map: Option<<C::Contours as FindContours>::Map>) {
        self.contours.set_map(map);
        self.begin_other_contours();
    }

    /// Scans are compared with other surfaces from now on.
    fn begin_other_contours(&mut self) {
        self.slam.forget_way_behind();
        self.laser_odometry.stop();
    }

    /// The map of contours, if scans are compared with one.
    #[must_use]
    pub fn contours(&self) -> Option<<C::Contours as FindContours>::Map> {
        self.contours.map().filter(|_| self.parameters.sources.contours)
    }

    /// What a search for a start goes through: the reflectors, and the map of contours, if scans are compared with one. It is for a
    /// localiser that is lost or has no pose.
    pub fn for_search(&mut self) -> (MapView<'_>, ContourSearch<'_, C::Contours>) {
        let contours = if self.parameters.sources.contours { self.contours.for_search() } else { None };
        (self.maps.reflectors(), contours)
    }

    /// Whether scans are compared with a map of contours.
    pub(super) fn uses_contours(&self) -> bool {
        self.parameters.sources.contours && self.contours.has_map()
    }

    /// Corrects the pose by where the surfaces of the scan have the laser, which is at `mount`. The points of the scan are found, and
    /// the workspace has the path of the laser.
    pub(super) fn fuse_contours(&mut self, mount: &Pose, scan: &Scan) {
        let time = scan.beam_time(scan.ranges.len() / 2);
        let Some(timeline) = self.timeline.begun_mut().filter(|_| self.lost.is_none()) else { return };
        let Ok(state) = timeline.state_at(time) else {
            let status = &mut self.outputs.sources.contours;
            status.begin(time);
            return status.add(time, Verdict::OutOfTime, false, None);
        };
        let place = self.workspace.path.place(time.since(scan.start));
        let frame = mount.compose(&place.inverse());
        let outcome = self.see_contours(time, &frame, &state);
        let is_used = outcome.wanted().is_some_and(|seen| self.timeline.fuse_pose(time, &seen) == Ok(true));
        if let Ok(state) = self.timeline.state_at(time) {
            self.learn_contours(&outcome, is_used, &frame, &state);
        }
        self.tell_contours(time, scan.laser, &outcome, is_used);
    }

    /// The same with landmarks in the state, where the filter stands; `place` is where the laser was then in the frame of the points.
    pub(super) fn fuse_contours_by_slam(&mut self, mount: &Pose, place: &Pose, laser: LaserId) {
        if self.lost.is_some() {
            return;
        }
        let (time, state) = (self.slam.time(), self.slam.state());
        let frame = mount.compose(&place.inverse());
        let outcome = self.see_contours(time, &frame, &state);
        let is_used = outcome.wanted().is_some_and(|seen| seen.apply(self.slam.parts().0));
        let state = self.slam.state();
        self.learn_contours(&outcome, is_used, &frame, &state);
        self.tell_contours(time, laser, &outcome, is_used);
    }

    /// Compares the scan with the map; the frame of its points is at `frame` in R, which is at `state` at that time.
    fn see_contours(&mut self, time: Time, frame: &Pose, state: &Ekf) -> ContourOutcome {
        let is_led = self.distance.reflector <= self.parameters.limits.dead_reckoning_from
            && state.position_deviation() <= BY_REFLECTORS;
        let step = self.step_until(time);
        see_contours(&mut self.contours, self.features.points(), frame, (state, &step), is_led)
    }

    /// Learns what the scan shows beside the map, from a pose that it has corrected, or that reflectors know better and it does not contradict.
    fn learn_contours(&mut self, outcome: &ContourOutcome, is_used: bool, frame: &Pose, state: &Ekf) {
        if is_used || outcome.agrees() {
            let deviation = (state.position_deviation(), state.heading_deviation());
            self.contours.learn(&state.pose.compose(frame), deviation);
        }
    }

    /// The motion since the scan that was compared with contours before.
    fn step_until(&self, time: Time) -> Pose {
        let from = self.outputs.sources.contours.told.unwrap_or(time);
        self.timeline.displacement(from, time)
    }

    /// Whether scans of the first laser are compared with the contours of the way behind: without a kept map, and with past poses in
    /// the state.
    pub(super) fn uses_contours_behind(&self) -> bool {
        let parameters = &self.parameters;
        parameters.maps.slam && parameters.sources.contours && C::Contours::KEYS > 0 && !self.contours.has_map()
    }

    /// Corrects the pose by the contours of the way behind, where the filter stands.
    pub(super) fn fuse_contours_behind(&mut self, laser: LaserPlace) {
        let step = self.step_until(self.slam.time());
        let is_led = self.distance.reflector <= LED_BEHIND && self.outputs.sources.reflectors.gated == 0;
        let scan = ScanBehind { points: self.features.points(), laser, step, is_led };
        let told = (self.slam.time(), &mut self.outputs.sources.contours);
        self.contour_correction = ContourCorrection::Applied;
        if self.behind.see(&mut self.contours, self.slam.parts().0, &scan, told) {
            self.distance.feature = 0.0;
        }
        self.outputs.has_cut |= self.contours.has_cut();
    }

    /// Makes the scan one of the way behind if it is time for one.
    pub(super) fn keep_contours_behind(&mut self, laser: &LaserPlace) {
        self.behind.keep(&mut self.contours, self.slam.parts().0, laser);
    }

    /// Whether surfaces are followed where no landmark is in sight: contours have nothing else to do then.
    fn follows_surfaces(&self) -> bool {
        let parameters = &self.parameters;
        let is_free = !parameters.maps.slam && !self.contours.has_map();
        is_free && C::Contours::KEYS > 0 && parameters.sources.contours && parameters.protection
    }

    /// Lets laser odometry go on by what the first laser has told, after its landmarks have corrected the pose.
    #[inline(never)]
    pub(super) fn follow_surfaces(&mut self, event: &Event) {
        if event.laser() != Some(LaserId::FIRST) || !self.follows_surfaces() {
            return;
        }
        let is_fixed = |seen: &&LandmarkUse| {
            seen.verdict == Verdict::Accepted
                && seen.landmark.is_some_and(|(source, _)| source == LandmarkSource::Fixed)
        };
        let used = self.outputs.uses.iter().filter(is_fixed).count();
        let Event::Scan(scan) = event else { return self.laser_odometry.use_reflectors(used) };
        self.laser_odometry.use_features(used);
        let mount = *self.parameters.lasers.first();
        let Some(timeline) = self.timeline.begun_mut().filter(|_| self.lost.is_none() && !self.laser_odometry.is_led())
        else {
            return self.laser_odometry.stop();
        };
        let since = timeline.displacement(scan.start, timeline.now());
        let laser = since.inverse().compose(&mount);
        let laser = LaserAtStart {
            in_world: timeline.state().pose.compose(&laser),
            by_odometry: timeline.odometry_pose().compose(&laser),
        };
        // Where features are looked for, its points have been taken.
        if !(self.parameters.maps.features || self.parameters.maps.dynamic) {
            let workspace = &mut self.workspace;
            workspace.path.set(scan.start, &mount, timeline.relative_path(scan.start, scan.end()));
            self.outputs.has_cut |= self.features.take(&workspace.path, &self.parameters.features, scan);
        }
        self.contours.see(self.features.points());
        self.laser_odometry.follow(&mut self.contours, &laser);
        self.outputs.has_cut |= self.contours.has_cut();
    }

    fn tell_contours(&mut self, time: Time, laser: LaserId, outcome: &ContourOutcome, is_used: bool) {
        self.outputs.has_cut |= self.contours.has_cut();
        let verdict = if is_used || outcome.verdict != Verdict::Accepted { outcome.verdict } else { Verdict::Unknown };
        let status = &mut self.outputs.sources.contours;
        status.begin(time);
        status.add(time, verdict, is_used, outcome.test_ratio);
        if let Some(seen) = outcome.seen.filter(|_| is_used) {
            self.distance.feature = 0.0;
            self.contour_correction = if laser == LaserId::FIRST {
                ContourCorrection::Told { time, seen }
            } else {
                ContourCorrection::Applied
            };
        }
    }
}
