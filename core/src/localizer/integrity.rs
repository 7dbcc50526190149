//! Whether the motion that the laser sees fits the odometry, and whether the laser is where it is believed to be.

use super::{Localizer, PoseFix, Reason};
use crate::geometry::Pose;
use crate::landmarks::{LandmarkKind, Verdict};
use crate::measurement::Time;

/// Where the vehicle is, and where it would be by odometry alone.
#[derive(Clone, Copy, Debug)]
pub(super) struct Estimate {
    pose: Pose,
    smooth: Pose,
}

/// A vehicle whose wheel has spun or slid is off by no more than this to the side, m, and in its heading, rad.
const LARGEST_SLIP: (f64, f64) = (0.05, 0.026);

/// What is added to both for each metre of the way.
const LARGEST_DRIFT: f64 = 0.03;

/// Whether the laser may have been knocked, if the vehicle seems to have jumped by so much in R on a way of so many metres.
/// Who carries a vehicle may knock its laser, too.
fn is_knock(jump: &Pose, way: f64) -> bool {
    let (side, turn) = (LARGEST_SLIP.0 + LARGEST_DRIFT * way, LARGEST_SLIP.1 + LARGEST_DRIFT * way);
    libm::fabs(jump.y) > side || libm::fabs(jump.theta) > turn
}

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
    /// The pose for now, and that by odometry alone.
    pub(super) fn estimate(&mut self) -> Option<Estimate> {
        let timeline = self.timeline.begun_mut()?;
        Some(Estimate { pose: timeline.state().pose, smooth: *timeline.odometry_pose() })
    }

    /// The pose at `time`, or that for now if there is none for then.
    fn pose_at(&mut self, time: Time) -> Option<Pose> {
        let timeline = self.timeline.begun_mut()?;
        Some(timeline.state_at(time).unwrap_or_else(|_| timeline.state()).pose)
    }

    /// Begins the checks anew for a pose that is given, before it is taken.
    pub(super) fn restart_checks(&mut self, fix: &PoseFix) {
        let is_contradicted = matches!(
            self.lost,
            Some(Reason::MotionDisagrees | Reason::LandmarksRejected | Reason::InnovationsTooLarge)
        );
        // Who was never right after the last pose was told it wrongly.
        if is_contradicted
            && self.corrected_at.is_some()
            && let Some(before) = self.pose_at(fix.time)
            && is_knock(&before.between(&fix.pose), 0.0)
        {
            self.drift_check.suspect_laser();
        }
        self.motion_check.clear();
        self.drift_check.restart();
        self.corrected_at = None;
    }

    /// Compares what an event has shown with what the odometry says; `before` is the estimate before it was used, and
    /// `is_revolution` says whether the event tells the reflectors of a revolution.
    pub(super) fn check_motion(&mut self, before: &Estimate, is_revolution: bool) {
        let Some(after) = self.estimate() else { return };
        // One that tells no reflectors contradicts none of them.
        if is_revolution {
            self.check_reflectors(before);
        }
        if !self.outputs.uses.iter().any(|seen| seen.verdict == Verdict::Accepted) {
            return;
        }
        if let Some(last) = self.corrected_at {
            // What was extrapolated behind the last sample is in both.
            let is_same = before.smooth == after.smooth;
            let expected =
                if is_same { before.pose } else { before.pose.compose(&before.smooth.between(&after.smooth)) };
            let (motion, correction) = (last.between(&after.smooth), expected.between(&after.pose));
            self.drift_check.add(&motion, &correction);
            // What the gate let pass may still be more than the odometry can be wrong by.
            if is_knock(&correction, motion.position().norm()) {
                self.drift_check.suspect_laser();
            }
        }
        self.corrected_at = Some(after.smooth);
    }

    /// Whether the reflectors of a revolution are where those before have been, as the odometry says.
    fn check_reflectors(&mut self, before: &Estimate) {
        let to_odometry = before.smooth.compose(&before.pose.inverse());
        self.motion_check.begin(self.timeline.now());
        for seen in self.outputs.uses.iter().filter(|seen| seen.kind == LandmarkKind::Reflector) {
            let [x, y] = seen.position.map(f64::from);
            let place = to_odometry.transform(&seen.located.into());
            self.motion_check.see(&place, libm::hypot(x, y));
        }
        if self.lost.is_none() && self.motion_check.disagrees() {
            self.lost = Some(Reason::MotionDisagrees);
        }
    }
}
