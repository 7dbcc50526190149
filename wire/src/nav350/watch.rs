//! Whether the sensor can be used, from what its session says.

use super::{LostReason, MethodName, Report};
use agv_core::measurement::Time;
use agv_core::state::LaserHealth;

/// A sensor that has said nothing for so long is silent, s: a revolution and a little.
const SILENCE: f64 = 0.2;

/// Remembers when the sensor last measured, and what was wrong since.
#[derive(Clone, Copy, Debug, Default)]
pub struct SensorWatch {
    measured: Option<Time>,
    trouble: Option<LaserHealth>,
}

impl SensorWatch {
    /// A watch that has seen nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self { measured: None, trouble: None }
    }

    /// A revolution was complete.
    pub fn measured(&mut self, now: Time) {
        *self = Self { measured: Some(now), trouble: None };
    }

    /// The sensor could not be reached, or the connection broke.
    pub fn unreachable(&mut self) {
        self.trouble = Some(LaserHealth::Silent);
    }

    /// The session has given the connection up. A sensor that answers, but refuses what it must do, is faulty.
    pub fn lost(&mut self, reason: LostReason) {
        self.trouble = Some(match reason {
            LostReason::NotConnected | LostReason::Closed | LostReason::NoAnswer(_) => LaserHealth::Silent,
            LostReason::AccessDenied
            | LostReason::Refused(..)
            | LostReason::Failed(..)
            | LostReason::Overflow
            | LostReason::Babble => LaserHealth::Faulty,
        });
    }

    /// The session has reported something. A sensor that answers questions for data with errors, or with what is no
    /// revolution, is faulty until it measures again.
    pub fn reported(&mut self, report: Report) {
        let is_fault = matches!(
            report,
            Report::MethodFailed(MethodName::GetData | MethodName::GetLandmarkData, _)
                | Report::Undecodable(_)
                | Report::Revolution(_)
        );
        if is_fault {
            self.trouble = Some(LaserHealth::Faulty);
        }
    }

    /// The sensor's health.
    #[must_use]
    pub fn health(&self, now: Time) -> LaserHealth {
        match (self.trouble, self.measured) {
            (Some(trouble), _) => trouble,
            (None, None) => LaserHealth::Unknown,
            (None, Some(time)) if now.since(time) <= SILENCE => LaserHealth::Sound,
            (None, Some(_)) => LaserHealth::Silent,
        }
    }
}
