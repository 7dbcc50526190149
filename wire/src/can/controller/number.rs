//! The numbers of the telegrams where each has an object of its own.

use agv_core::integrity::Alarm;
use agv_core::measurement::EncoderFault;
use agv_core::state::{LaserHealth, Mode, Reason, Relocalization};

use super::field::Field;
use super::numbers::{ALARMS, FAULTS, LASERS, MODES, REASONS, RELOCALIZATIONS, number_of};

/// A coordinate, m.
pub(in crate::can) const LENGTH: Field = Field::signed(0, 32, 1e-4);
/// A heading, rad.
pub(in crate::can) const ANGLE: Field = Field::signed(0, 32, 1e-6);
/// A distance travelled, m.
pub(in crate::can) const DISTANCE: Field = Field::unsigned(0, 16, 0.01);
/// A deviation of a coordinate, m.
pub(in crate::can) const DEVIATION: Field = Field::unsigned(0, 16, 1e-4);
/// A bound of a position, m.
pub(in crate::can) const BOUND: Field = Field::unsigned(0, 16, 1e-3);
/// A bound or a deviation of a heading, rad.
pub(in crate::can) const SMALL_ANGLE: Field = Field::unsigned(0, 16, 1e-4);
/// A number of a table.
const BYTE: Field = Field::unsigned(0, 8, 1.0);

pub(in crate::can) fn of_mode(mode: Mode) -> u64 {
    number_of(&MODES, &mode, BYTE)
}

pub(in crate::can) fn of_reason(reason: Reason) -> u64 {
    number_of(&REASONS, &reason, BYTE)
}

pub(in crate::can) fn of_fault(fault: Option<EncoderFault>) -> u64 {
    fault.map_or(0, |fault| number_of(&FAULTS, &fault, BYTE))
}

pub(in crate::can) fn of_laser(laser: LaserHealth) -> u64 {
    number_of(&LASERS, &laser, BYTE)
}

pub(in crate::can) fn of_search(search: Relocalization) -> u64 {
    number_of(&RELOCALIZATIONS, &search, BYTE)
}

pub(in crate::can) fn of_alarm(alarm: Alarm) -> u64 {
    number_of(&ALARMS, &alarm, BYTE)
}
