//! The pose with its truth.

use serde::{Deserialize, Serialize};

use super::{Mode, ProtectionLevel, Reason};
use crate::geometry::{Pose, larger_axis};
use crate::measurement::Time;

/// The pose with its truth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseOutput {
    /// When the pose is true: the latest time that any event spoke of.
    pub time: Time,
    /// Pose of R in W.
    pub pose: Pose,
    /// Covariance in W: xx, xy, yy (m^2), x heading, y heading (m rad), heading (rad^2).
    pub covariance: [f64; 6],
    /// What the pose rests on.
    pub mode: Mode,
    /// Why.
    pub reason: Reason,
    /// Distance since a landmark last corrected the pose, m.
    pub dead_reckoning_distance: f64,
    /// By how far landmarks have moved the position since the output before, m.
    pub correction: f64,
    /// Pose of R in a frame that coincides with W when a pose is given and drifts with the odometry: it has no steps.
    pub smooth: Pose,
    /// Share of the observations of fixed landmarks that were accepted lately, 0 to 1.
    pub acceptance: f64,
    /// What bounds the errors of position and heading.
    pub level: ProtectionLevel,
    /// Mean normalised squared innovation of the accepted observations lately; 2 is expected.
    pub normalised_square: f64,
    /// How often the position has been reset, wrapping: by a pose that was given, or by a correction that
    /// [has jumped](Self::has_jumped). Unlike the correction it stays, so that who listens now and then misses none.
    pub resets: u8,
    /// By how far the last reset has moved the position, m; 0 for the first pose.
    pub last_reset: f32,
    /// How many scans and revolutions had more beams, features or reflectors than there was room for, wrapping. What is
    /// left out is spread over all directions, or is what is known worst.
    pub overflows: u8,
}

impl PoseOutput {
    /// A correction that a controller had better know of, m.
    pub const NOTABLE_CORRECTION: f64 = 0.01;

    /// Whether landmarks have moved the position by more than [`Self::NOTABLE_CORRECTION`] since the output before.
    #[must_use]
    pub fn has_jumped(&self) -> bool {
        self.correction > Self::NOTABLE_CORRECTION
    }

    /// Counts a reset of the position by so many metres.
    pub(crate) fn count_reset(&mut self, distance: f64) {
        self.resets = self.resets.wrapping_add(1);
        self.last_reset = distance.min(f64::from(f32::MAX)) as f32;
    }

    /// A position that is no less sure than this in any direction, m, and a heading, rad, are good enough to leave the
    /// reflectors: on a distance of 12 m by features alone they leave most of 2 cm and 0.1 deg to the drive.
    pub const GOOD_DEVIATIONS: (f64, f64) = (0.005, 0.524e-3);

    /// Whether the pose is good enough to begin a drive without reflectors. A vehicle that stands among them becomes surer
    /// with every revolution until it is.
    #[must_use]
    pub fn is_good(&self) -> bool {
        let is_localised =
            !matches!(self.mode, Mode::NotLocalised | Mode::Lost | Mode::WithoutOdometry | Mode::Degraded);
        let [xx, xy, yy, _, _, heading] = self.covariance;
        let (position_limit, heading_limit) = Self::GOOD_DEVIATIONS;
        let worst = larger_axis(xx, xy, yy);
        is_localised && worst <= position_limit * position_limit && heading <= heading_limit * heading_limit
    }

    /// The frame of the smooth pose in W.
    #[must_use]
    pub fn smooth_offset(&self) -> Pose {
        self.pose.compose(&self.smooth.inverse())
    }
}
