//! Whether the motion that the laser sees fits the odometry, and whether the laser is where it is believed to be.

use super::{Localizer, PoseFix, Reason};
use crate::filter::Ekf;
use crate::geometry::Pose;
use crate::maps::{LandmarkKind, Verdict};
use crate::measurement::Time;

/// Where the vehicle is, and where it would be by odometry alone.
#[derive(Clone, Copy, Debug)]
pub(super) struct Estimate {
    pub pose: Pose,
    smooth: Pose,
    is_sure: bool,
    /// Way since a landmark last corrected the pose, m.
    way: f64,
}

/// The last revolution that has corrected the pose.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corrected {
    /// Pose by odometry.
    smooth: Pose,
    /// Whether the pose was known so well that what corrects it later says something of the way since.
    is_sure: bool,
}

/// A vehicle whose wheel has spun or slid is off by no more than this to the side, m, and in its heading, rad.
const LARGEST_SLIP: (f64, f64) = (0.05, 0.026);

/// What is added to both for each metre of the way.
const LARGEST_DRIFT: f64 = 0.03;

/// What was not known of a pose may be this many deviations.
const UNSURE: f64 = 3.0;

/// Whether the laser may have been knocked, if the vehicle seems to have jumped by so much in R on a way of so many metres
/// from a pose, or to one, whose position and heading have these deviations, m and rad. Who carries a vehicle may knock its
/// laser, too.
fn is_knock(jump: &Pose, way: f64, deviations: (f64, f64)) -> bool {
    // A slip as large as one can be and a pose as wrong as it can be seldom come together.
    let drift = LARGEST_DRIFT * way;
    libm::fabs(jump.y) > (LARGEST_SLIP.0 + drift).max(UNSURE * deviations.0)
        || libm::fabs(jump.theta) > (LARGEST_SLIP.1 + drift).max(UNSURE * deviations.1)
}

/// Whether what is not known of a pose is less than a slip.
fn is_sure(state: &Ekf) -> bool {
    const LIMITS: (f64, f64) = (LARGEST_SLIP.0 / UNSURE, LARGEST_SLIP.1 / UNSURE);
    let covariance = &state.covariance;
    covariance.m11 + covariance.m22 <= LIMITS.0 * LIMITS.0 && covariance.m33 <= LIMITS.1 * LIMITS.1
}

/// Whether a way, m, leads on by about its length, or is short: corrections after one that winds are none of the distance
/// between its ends.
fn leads_on(motion: &Pose, way: f64) -> bool {
    way <= 1.0 || motion.position().norm() >= 0.8 * way
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
        let state = timeline.state();
        Some(Estimate {
            pose: state.pose,
            smooth: *timeline.odometry_pose(),
            is_sure: is_sure(&state),
            way: self.distance.any(),
        })
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
            && is_knock(
                &before.between(&fix.pose),
                self.distance.any(),
                (fix.position_deviation, fix.heading_deviation),
            )
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
            let correction = expected.between(&after.pose);
            // What was not known of the pose before is nothing that the way since has shown.
            if last.is_sure {
                let motion = last.smooth.between(&after.smooth);
                if leads_on(&motion, before.way) {
                    self.drift_check.add(&motion, &correction);
                }
                // What the gate let pass may still be more than the odometry can be wrong by.
                if is_knock(&correction, before.way, (0.0, 0.0)) {
                    self.drift_check.suspect_laser();
                }
            }
        }
        // What is contradicted at once has not put the pose right, and without an odometry nothing tells what will.
        if self.lost.is_none() && self.blindness.is_none() {
            self.corrected_at = Some(Corrected { smooth: after.smooth, is_sure: after.is_sure });
        }
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
