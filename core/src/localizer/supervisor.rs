//! What the vehicle says of its pose: verdicts become a mode and a reason here and nowhere else.

use crate::integrity::{Integrity, Suspect};
use crate::measurement::Time;
use crate::state::{Mode, Reason};

/// What the pose rests on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Support {
    /// Whether reflectors have corrected the pose lately.
    pub by_reflectors: bool,
    /// Whether natural features have.
    pub by_features: bool,
}

/// What a gyro, if there is one, the wheels, and surfaces where they lead elsewhere say of each other.
pub(super) fn remark_on_motion(integrity: &Integrity, has_gyro: bool, is_elsewhere: bool, now: Time) -> Option<Reason> {
    let turns = &integrity.turns;
    let fault = if has_gyro { turns.fault(now).map(|_| Reason::GyroFault) } else { None };
    let slips = integrity.redundancy.slips(now) || (has_gyro && turns.slips(now));
    fault.or_else(|| slips.then_some(Reason::WheelsSlip)).or_else(|| is_elsewhere.then_some(Reason::OdometryDisagrees))
}

/// The mode, and why it is so. `lost` and `outage` say why there is no pose, and why there is no odometry; `motion` is what gyro and
/// wheels say of each other.
pub(super) fn supervise(
    lost: Option<Reason>,
    outage: Option<Reason>,
    motion: Option<Reason>,
    support: Support,
    integrity: &Integrity,
    now: Time,
) -> (Mode, Reason) {
    if let Some(reason) = lost {
        return (Mode::Lost, reason);
    }
    if let Some(reason) = outage {
        return (Mode::WithoutOdometry, reason);
    }
    let suspect = integrity.suspect();
    let remark = match suspect {
        _ if integrity.traction.slips(now) => Reason::WheelsSlip,
        Some(Suspect::Odometry) => Reason::OdometryDisagrees,
        _ => Reason::None,
    };
    let remark = motion.unwrap_or(remark);
    match (support.by_reflectors, support.by_features) {
        (false, false) => (Mode::DeadReckoning, motion.unwrap_or(Reason::NoLandmarks)),
        _ if suspect == Some(Suspect::Laser) => (Mode::Degraded, Reason::LaserMoved),
        _ if integrity.innovations.is_doubtful() => (Mode::Degraded, Reason::LandmarksRejected),
        (true, true) => (Mode::Mixed, remark),
        (true, false) => (Mode::Reflectors, remark),
        (false, true) => (Mode::Features, remark),
    }
}
