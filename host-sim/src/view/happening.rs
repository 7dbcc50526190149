//! What one may want to jump to.

use agv_core::geometry::Pose;
use agv_core::localizer::{Mode, PoseOutput, Reason};
use agv_core::measurement::{EncoderFault, EncoderFaults};
use serde::Serialize;

use crate::drive::reason_name;

/// What kind of thing happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum HappeningKind {
    /// The vehicle says that it is lost.
    Lost,
    /// It knows where it is, which it did not before.
    Relocalised,
    /// The pose jumped by more than a centimetre.
    Correction,
    /// Mode or reason changed in another way.
    Mode,
    /// An encoder became faulty or sound.
    Fault,
    /// Somebody gave a pose.
    PoseGiven,
    /// A note in the log.
    Note,
    /// The log is not as it was written.
    Damage,
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Happening {
    /// When, s of the log's clock.
    pub time_s: f64,
    /// What.
    pub kind: HappeningKind,
    /// In words.
    pub text: String,
}

/// Smallest correction that is worth a look, m.
const CORRECTION: f64 = 0.01;

/// The mode as it was last said.
#[derive(Clone, Copy, Debug)]
pub(super) struct ModeMemory {
    last: Option<(Mode, Reason)>,
    /// Whether the vehicle has been lost, or never known where it is, since it last was localised.
    was_lost: bool,
}

impl ModeMemory {
    pub(super) const NEW: Self = Self { last: None, was_lost: true };

    /// What the mode of an answer means, which is called `name`; None if nothing has changed.
    pub(super) fn take(&mut self, now: &PoseOutput, name: &str) -> Option<(HappeningKind, String)> {
        let before = self.last.replace((now.mode, now.reason));
        if before == self.last {
            return None;
        }
        let kind = if now.mode == Mode::Lost && before.is_none_or(|(mode, _)| mode != Mode::Lost) {
            HappeningKind::Lost
        } else if now.mode.is_localised() && self.was_lost {
            HappeningKind::Relocalised
        } else {
            HappeningKind::Mode
        };
        self.was_lost = now.mode == Mode::Lost || (self.was_lost && !now.mode.is_localised());
        let reason = reason_name(now.reason);
        Some((kind, if reason.is_empty() { name.to_owned() } else { format!("{name}: {reason}") }))
    }
}

/// What became of the encoders.
pub(super) fn of_faults(faults: &EncoderFaults) -> String {
    let name =
        |fault: Option<EncoderFault>| fault.map_or("sound".to_owned(), |fault| format!("{fault:?}").to_lowercase());
    format!("encoders: drive {}, steering {}", name(faults.drive), name(faults.steering))
}

/// By how much landmarks moved the pose: from where the motion between the last two poses would have led to where it is
/// said to be, m. `before` are these two poses, the older one first.
pub(super) fn correction(before: &[PoseOutput], now: &PoseOutput) -> f64 {
    let [.., last] = before else { return 0.0 };
    let ahead = now.time.since(last.time);
    let predicted = match before {
        [.., older, last] if ahead > 0.0 && last.time > older.time => {
            let share = ahead / last.time.since(older.time);
            last.pose.compose(&older.pose.between(&last.pose).fraction(share))
        }
        _ => last.pose,
    };
    let Pose { x, y, .. } = predicted.between(&now.pose);
    x.hypot(y)
}

/// A correction that is worth a look, in words.
pub(super) fn of_correction(correction: f64) -> Option<String> {
    (correction > CORRECTION).then(|| format!("corrected by {:.1} cm", 100.0 * correction))
}
