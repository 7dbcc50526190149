//! Faults that the controller tells the bus, for people who read what it has said.

use std::fmt;

use agv_wire::can::controller_node::ErrorKind;
use agv_wire::can::emcy::Emergency;

/// What is wrong, in words.
const WORDS: [(ErrorKind, &str); 14] = [
    (ErrorKind::Board, "a part of the board does not work"),
    (ErrorKind::Panicked, "the program ended by itself the last time"),
    (ErrorKind::SettingsLost, "not everything that was set was found, or it cannot be stored"),
    (ErrorKind::Overrun, "frames of the bus came faster than they were taken"),
    (ErrorKind::BusOff, "errors had driven the controller off the bus"),
    (ErrorKind::HeartbeatLost, "a node that is watched has no heartbeat"),
    (ErrorKind::Laser, "the laser is silent or faulty"),
    (ErrorKind::DriveEncoder, "the encoder of a driven wheel, or the report of the own controller"),
    (ErrorKind::SteeringEncoder, "the encoder of a steering"),
    (ErrorKind::Lost, "the vehicle does not know any more where it is"),
    (ErrorKind::Overload, "the controller is too slow for what it is told"),
    (ErrorKind::PoseRefused, "an initial pose was refused"),
    (ErrorKind::Pause, "the processor stands still while a page is erased"),
    (ErrorKind::DiscreteLine, "a discrete line cannot be set or read"),
];

/// An emergency of the controller itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Its number, as it is in the frame.
    pub code: u16,
    /// Which parts it concerns: a bit for each, of encoders in the order of the settings.
    pub parts: u8,
    /// Whether it is over.
    pub is_over: bool,
}

impl Fault {
    /// What an emergency tells. Its end carries the number of what has ended.
    #[must_use]
    pub const fn of(emergency: &Emergency) -> Self {
        let [low, high, ..] = emergency.details;
        if emergency.is_reset() {
            return Self { code: u16::from_le_bytes([low, high]), parts: 0, is_over: true };
        }
        Self { code: emergency.code, parts: low, is_over: false }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let found = WORDS.iter().find(|(kind, _)| kind.code() == self.code);
        let is_of_encoders =
            found.is_some_and(|(kind, _)| matches!(kind, ErrorKind::DriveEncoder | ErrorKind::SteeringEncoder));
        write!(formatter, "fault {:04X}h", self.code)?;
        if self.is_over {
            return formatter.write_str(" is over");
        }
        write!(formatter, ": {}", found.map_or("unknown", |(_, words)| words))?;
        for number in (0..u8::BITS).filter(|bit| is_of_encoders && self.parts >> bit & 1 == 1) {
            write!(formatter, ", encoder {}", number + 1)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use agv_wire::can::emcy::Emergency;

    use super::Fault;

    #[test]
    fn a_fault_is_told_with_its_number() {
        let told = |code, details| Fault::of(&Emergency { code, register: 1, details }).to_string();
        assert_eq!(told(0x7300, [0; 5]), "fault 7300h: the laser is silent or faulty");
        let encoders = told(0x7305, [0b1001, 0, 0, 0, 0]);
        assert!(encoders.starts_with("fault 7305h") && encoders.ends_with(", encoder 1, encoder 4"), "{encoders}");
        assert_eq!(told(0, [0x05, 0x73, 0, 0, 0]), "fault 7305h is over");
        assert_eq!(told(0x1234, [3; 5]), "fault 1234h: unknown");
    }
}
