//! What the outputs mean.

use agv_core::integrity::{Alarm, AlertLimits};
use agv_core::measurement::Time;
use agv_core::state::PoseOutput;
use agv_settings::Settings;

use crate::EncoderNodes;

/// A pose is too old for a wire after so many cycles, as its telegrams are for whoever listens to the bus (the book, "From the bus to my
/// PLC").
const DEADLINE: f64 = 5.0;

/// What the outputs say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DiscreteOutputs {
    /// The pose may be driven by: it rests on landmarks ([`agv_core::state::Mode::is_localised`]), its protection level is within the alert
    /// limit of travel, and it is no older than [`DiscreteReport::deadline`].
    pub is_pose_valid: bool,
    /// It may be docked by: it is valid, and its protection level is within the alert limit of docking.
    pub is_within_docking_limits: bool,
    /// The error register (object 1001h) is not 0, a line has failed, or the controller says nothing.
    pub is_faulty: bool,
}

impl DiscreteOutputs {
    /// What they say when nobody knows better.
    pub const SAFE: Self = Self { is_pose_valid: false, is_within_docking_limits: false, is_faulty: true };
}

/// What the controller says at one moment, for the wires.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiscreteReport {
    /// When it says it.
    pub time: Time,
    /// It holds for so long, s.
    pub deadline: f64,
    /// What it says.
    pub outputs: DiscreteOutputs,
}

impl DiscreteReport {
    /// How long a pose, or a report, is used, s: five cycles of the poses, or of the encoders if these are longer.
    #[must_use]
    pub fn deadline(settings: &Settings) -> f64 {
        let publishing = 1e-3 * f64::from(settings.publishing_period);
        DEADLINE * publishing.max(EncoderNodes::of(settings).period())
    }

    /// That of a pose, if there is one, and of the error register at `time`.
    #[must_use]
    pub fn of(pose: Option<&PoseOutput>, limits: &AlertLimits, error_register: u8, deadline: f64, time: Time) -> Self {
        let alarm = pose
            .filter(|pose| pose.mode.is_localised() && time.since(pose.time) <= deadline)
            .map_or(Alarm::NoPose, |pose| limits.alarm(pose.mode, &pose.level));
        let outputs = DiscreteOutputs {
            is_pose_valid: alarm <= Alarm::Docking,
            is_within_docking_limits: alarm == Alarm::None,
            is_faulty: error_register != 0,
        };
        Self { time, deadline, outputs }
    }

    /// What it says at `now`: nothing any more behind its deadline.
    #[must_use]
    pub fn outputs(&self, now: Time) -> DiscreteOutputs {
        if now.since(self.time) <= self.deadline { self.outputs } else { DiscreteOutputs::SAFE }
    }
}
