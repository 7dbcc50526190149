//! A pose that somebody gives.

use super::evidence::DistanceSince;
use super::travel::Outage;
use super::{Capacities, Localizer, Misuse, Mode, PoseFix, Reason};
use crate::filter::Ekf;
use crate::geometry::{Pose, wrap};
use crate::integrity::{Estimate, Replacement};
use crate::maps::Verdict;
use crate::odometry::{Coasting, Motion};
use crate::sources::{FindContours, LandmarkMaps};

impl<C: Capacities> Localizer<C> {
    #[inline(never)]
    pub(super) fn set_pose(&mut self, fix: &PoseFix) {
        if !self.parameters.sources.given_pose {
            return;
        }
        self.outputs.sources.given_pose.begin(fix.time);
        if !fix.is_sound() {
            self.outputs.misuse = Some(Misuse::NoPose);
            return;
        }
        let is_past = self.timeline.begun().is_some_and(|timeline| fix.time < timeline.now());
        // A pose of a time that has not come yet is no reason to refuse one of now.
        if is_past && self.lost != Some(Reason::NoPose) && self.timeline.reaches(fix.time).is_err() {
            self.outputs.misuse = Some(Misuse::TooLate);
            return;
        }
        let pose = Pose { theta: wrap(fix.pose.theta), ..fix.pose };
        let state = Ekf::new(pose, fix.position_deviation, fix.heading_deviation);
        let replacement = self.replaced_by(fix);
        self.integrity.restart(self.parameters.consistency, replacement.as_ref());
        if self.parameters.protection {
            self.separation.step(self.timeline.now(), self.timeline.odometry_pose());
        }
        if is_past && self.lost == Some(Reason::NoPose) {
            self.timeline.forget();
        }
        self.timeline.begin(fix.time, state);
        let was_contradicted = self.start_watch.end();
        if self.parameters.protection {
            let (now, state) = (self.timeline.now(), self.timeline.state());
            self.separation.begin(now, &state.pose, &state.covariance_entries(), self.timeline.odometry_pose());
            let is_rejected = matches!(self.lost, Some(Reason::LandmarksRejected | Reason::InnovationsTooLarge));
            if was_contradicted || is_rejected {
                self.separation.doubt_mounting();
            }
        }
        self.slam.begin(fix.time, &state, &self.parameters.slam);
        if let Some(gyro) = &mut self.gyro {
            gyro.begin_pose();
        }
        // Whoever has searched for it may have used the room of what was loaded.
        self.contours.begin_anew();
        self.laser_odometry.stop();
        self.lost = None;
        self.outputs.sources.given_pose.add(fix.time, Verdict::Accepted, true, None);
        if !is_past {
            let standing = Coasting::new(Motion::none(fix.time));
            self.outage = self.outage.map(|outage| Outage { coasting: standing, corrected: None, ..outage });
        }
        let since = self
            .timeline
            .motions(fix.time, self.timeline.now())
            .fold(0.0, |distance, motion| distance + motion.distance);
        self.distance = DistanceSince { fix: since, ..DistanceSince::NEVER };
        self.maps.forget_found();
        self.count_given_pose();
    }

    fn count_given_pose(&mut self) {
        let Some(Estimate { pose, .. }) = self.estimate() else { return };
        let last = &mut self.outputs.pose;
        let is_first = last.mode == Mode::NotLocalised;
        let distance = if is_first { 0.0 } else { libm::hypot(pose.x - last.pose.x, pose.y - last.pose.y) };
        last.count_reset(distance);
    }

    /// What a given pose replaces, if it was contradicted.
    fn replaced_by(&mut self, fix: &PoseFix) -> Option<Replacement> {
        let contradictions =
            [Reason::MotionDisagrees, Reason::LandmarksRejected, Reason::InnovationsTooLarge].map(Some);
        if !contradictions.contains(&self.lost) {
            return None;
        }
        let distance = self.distance.any();
        let timeline = self.timeline.begun_mut()?;
        let before = timeline.state_at(fix.time).unwrap_or_else(|_| timeline.state()).pose;
        let deviations = (fix.position_deviation, fix.heading_deviation);
        Some(Replacement { jump: before.between(&fix.pose), distance, deviations })
    }
}
