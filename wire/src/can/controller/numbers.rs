//! Numbers that stand for modes, reasons, faults and states.

use agv_core::integrity::Alarm;
use agv_core::measurement::EncoderFault;
use agv_core::state::{LaserHealth, Mode, Reason, Relocalization};

use super::error::ControllerError;
use super::field::Field;

/// Numbers of the modes on the bus.
pub(super) const MODES: [(u64, Mode); 8] = [
    (0, Mode::NotLocalised),
    (1, Mode::Reflectors),
    (2, Mode::Features),
    (3, Mode::Mixed),
    (4, Mode::DeadReckoning),
    (5, Mode::Lost),
    (6, Mode::WithoutOdometry),
    (7, Mode::Degraded),
];

/// Numbers of the reasons on the bus.
pub(super) const REASONS: [(u64, Reason); 15] = [
    (0, Reason::None),
    (1, Reason::NoPose),
    (2, Reason::NoLandmarks),
    (3, Reason::LandmarksRejected),
    (4, Reason::InnovationsTooLarge),
    (5, Reason::Uncertain),
    (6, Reason::OdometryImplausible),
    (7, Reason::DriveEncoder),
    (8, Reason::SteeringEncoder),
    (9, Reason::MotionDisagrees),
    (10, Reason::LaserMoved),
    (11, Reason::OdometryDisagrees),
    (12, Reason::OdometrySilent),
    (13, Reason::WheelsSlip),
    (14, Reason::GyroFault),
];

/// Numbers of the encoder faults on the bus; 0 is none.
pub(super) const FAULTS: [(u64, EncoderFault); 9] = [
    (1, EncoderFault::Late),
    (2, EncoderFault::Missing),
    (3, EncoderFault::Frozen),
    (4, EncoderFault::Jumped),
    (5, EncoderFault::OutOfRange),
    (6, EncoderFault::Reported),
    (7, EncoderFault::HeartbeatLost),
    (8, EncoderFault::WrongRange),
    (9, EncoderFault::WrongDirection),
];

pub(super) const ALARMS: [(u64, Alarm); 4] =
    [(0, Alarm::None), (1, Alarm::Docking), (2, Alarm::Travel), (3, Alarm::NoPose)];

pub(super) const LASERS: [(u64, LaserHealth); 4] =
    [(0, LaserHealth::Unknown), (1, LaserHealth::Sound), (2, LaserHealth::Silent), (3, LaserHealth::Faulty)];

pub(super) const RELOCALIZATIONS: [(u64, Relocalization); 5] = [
    (0, Relocalization::Idle),
    (1, Relocalization::Searching),
    (2, Relocalization::Ambiguous),
    (3, Relocalization::TooFew),
    (4, Relocalization::Unknown),
];

/// The number of a value; the unknown one of the field if it has none.
pub(super) fn number_of<T: PartialEq>(table: &[(u64, T)], value: &T, field: Field) -> u64 {
    table.iter().find(|(_, known)| known == value).map_or(field.unknown(), |(number, _)| *number)
}

pub(super) fn value_of<T: Copy>(table: &[(u64, T)], number: u64) -> Result<T, ControllerError> {
    table.iter().find(|(known, _)| *known == number).map(|(_, value)| *value).ok_or(ControllerError::Value)
}

pub(super) fn fault_of(number: u64) -> Result<Option<EncoderFault>, ControllerError> {
    if number == 0 { Ok(None) } else { value_of(&FAULTS, number).map(Some) }
}
