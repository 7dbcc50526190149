//! Whether the laser was knocked: landmarks put the pose right by more than the odometry can be wrong by.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use crate::filter::Ekf;
use crate::geometry::Pose;

/// Where the vehicle is, and where it would be by odometry alone.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    /// Pose of R in W.
    pub pose: Pose,
    /// The same, moved by the odometry alone.
    pub odometry_pose: Pose,
    /// Covariance of x, y (m) and heading (rad), in W.
    pub covariance: Matrix3<f64>,
    /// Whether what is not known of the pose is less than a slip.
    pub is_sure: bool,
    /// Distance since a landmark last corrected the pose, m.
    pub distance: f64,
}

impl Estimate {
    /// By how much landmarks have moved the pose to another estimate of the same time, in R behind the motion.
    #[must_use]
    pub fn correction_to(&self, after: &Self) -> Pose {
        // What was extrapolated behind the last sample is in both.
        let is_same = self.odometry_pose == after.odometry_pose;
        let moved = || self.odometry_pose.between(&after.odometry_pose);
        let expected = if is_same { self.pose } else { self.pose.compose(&moved()) };
        expected.between(&after.pose)
    }
}

/// The last revolution that has corrected the pose.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Corrected {
    odometry_pose: Pose,
    /// Whether the pose was known so well that what corrects it later says something of the distance since.
    is_sure: bool,
}

/// A vehicle whose wheel has spun or slid is off by no more than this to the side, m, and in its heading, rad.
const LARGEST_SLIP: (f64, f64) = (0.05, 0.026);

/// What is added to both for each metre of the distance.
const LARGEST_DRIFT: f64 = 0.03;

/// What was not known of a pose may be this many deviations.
const UNSURE: f64 = 3.0;

/// Whether what is not known of a pose is less than a slip.
#[must_use]
pub fn is_sure(state: &Ekf) -> bool {
    const LIMITS: (f64, f64) = (LARGEST_SLIP.0 / UNSURE, LARGEST_SLIP.1 / UNSURE);
    let covariance = state.covariance();
    covariance.m11 + covariance.m22 <= LIMITS.0 * LIMITS.0 && covariance.m33 <= LIMITS.1 * LIMITS.1
}

/// Whether the laser may have been knocked, if the vehicle seems to have jumped by so much in R on a distance of so many
/// metres from a pose, or to one, whose position and heading have these deviations, m and rad. Who carries a vehicle may knock
/// its laser, too.
fn is_knock(jump: &Pose, distance: f64, deviations: (f64, f64)) -> bool {
    // A slip as large as one can be and a pose as wrong as it can be seldom come together.
    let drift = LARGEST_DRIFT * distance;
    libm::fabs(jump.y) > (LARGEST_SLIP.0 + drift).max(UNSURE * deviations.0)
        || libm::fabs(jump.theta) > (LARGEST_SLIP.1 + drift).max(UNSURE * deviations.1)
}

/// Whether a motion leads on by about its length, m, or is short: corrections after one that winds are none of the distance
/// between its ends.
fn leads_on(motion: &Pose, distance: f64) -> bool {
    distance <= 1.0 || motion.position().norm() >= 0.8 * distance
}

/// What a correction of the pose tells.
#[derive(Clone, Copy, Debug)]
pub struct Jump {
    /// The motion since the last correction, by odometry, if what was corrected says something of it.
    pub motion: Option<Pose>,
    /// By how much the pose was corrected, in R.
    pub correction: Pose,
    /// Whether the odometry cannot be wrong by so much.
    pub is_knock: bool,
}

/// Remembers what the last correction left.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct JumpCheck {
    corrected: Option<Corrected>,
}

impl JumpCheck {
    /// A check that has seen nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self { corrected: None }
    }

    /// Forgets the last correction: where the vehicle is found again says nothing of the laser.
    pub fn forget(&mut self) {
        self.corrected = None;
    }

    /// Whether the laser may have been knocked, if a pose that was contradicted is replaced by one that lies `jump` beside it,
    /// in R, after a distance of so many metres; the given pose has these deviations, m and rad. Who was never right after
    /// the last pose was told it wrongly.
    #[must_use]
    pub fn is_knock(&self, jump: &Pose, distance: f64, deviations: (f64, f64)) -> bool {
        self.corrected.is_some() && is_knock(jump, distance, deviations)
    }

    /// Takes a correction by landmarks, from the estimate `before` to that `after`. What is contradicted at once, or what an
    /// odometry that fails has led to, does not put the pose right (`is_right`). None if nothing can be told.
    pub fn correct(&mut self, before: &Estimate, after: &Estimate, is_right: bool) -> Option<Jump> {
        let jump = self.corrected.and_then(|last| {
            let correction = before.correction_to(after);
            // What was not known of the pose before is nothing that the distance since has shown.
            last.is_sure.then(|| {
                let motion = last.odometry_pose.between(&after.odometry_pose);
                Jump {
                    motion: leads_on(&motion, before.distance).then_some(motion),
                    correction,
                    // What the gate let pass may still be more than the odometry can be wrong by.
                    is_knock: is_knock(&correction, before.distance, (0.0, 0.0)),
                }
            })
        });
        if is_right {
            self.corrected = Some(Corrected { odometry_pose: after.odometry_pose, is_sure: after.is_sure });
        }
        jump
    }
}
