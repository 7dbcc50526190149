//! What a vehicle can live with, and whether it may.

use serde::{Deserialize, Serialize};

use crate::state::{Mode, ProtectionLevel};

/// Largest errors that a use of the pose can live with (the alert limits of satellite navigation, RTCA DO-229).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AlertLimit {
    /// Of the position, m.
    pub position: f64,
    /// Of the heading, rad.
    pub heading: f64,
}

impl AlertLimit {
    /// Whether both bounds are within it.
    #[must_use]
    pub fn holds(&self, level: &ProtectionLevel) -> bool {
        level.position <= self.position && level.heading <= self.heading
    }
}

/// The alert limits of the uses of the pose.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AlertLimits {
    /// While the vehicle travels.
    pub travel: AlertLimit,
    /// While it docks.
    pub docking: AlertLimit,
}

impl Default for AlertLimits {
    /// 15 cm and 2 deg; 5 cm and 0.5 deg.
    fn default() -> Self {
        Self {
            travel: AlertLimit { position: 0.15, heading: 2.0 * core::f64::consts::PI / 180.0 },
            docking: AlertLimit { position: 0.05, heading: 0.5 * core::f64::consts::PI / 180.0 },
        }
    }
}

/// What the pose must not be used for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Alarm {
    /// Nothing.
    None,
    /// Docking: the protection level is above its alert limit.
    Docking,
    /// Docking and travelling.
    Travel,
    /// Anything: there is no pose.
    #[default]
    NoPose,
}

impl AlertLimits {
    /// What a pose of this mode must not be used for.
    #[must_use]
    pub fn alarm(&self, mode: Mode, level: &ProtectionLevel) -> Alarm {
        if matches!(mode, Mode::NotLocalised | Mode::Lost) {
            Alarm::NoPose
        } else if !self.travel.holds(level) {
            Alarm::Travel
        } else if !self.docking.holds(level) {
            Alarm::Docking
        } else {
            Alarm::None
        }
    }
}
