//! Refusals: the answer `sFA`.

use core::fmt;

/// Why a sensor refuses a telegram. Source: SICK's public driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault(pub u16);

impl Fault {
    /// The user level is too low.
    pub const ACCESS_DENIED: Self = Self(1);
    /// No such method.
    pub const UNKNOWN_METHOD: Self = Self(2);
    /// No such variable.
    pub const UNKNOWN_VARIABLE: Self = Self(3);
    /// A value is out of range, or the operating mode is wrong.
    pub const LOCAL_CONDITION: Self = Self(4);
    /// The arguments make no sense.
    pub const INVALID_DATA: Self = Self(5);
    /// The command word is unknown.
    pub const UNKNOWN_COMMAND: Self = Self(0x0C);

    /// What the number means.
    #[must_use]
    pub const fn meaning(self) -> &'static str {
        match self.0 {
            0x01 => "access denied",
            0x02 => "unknown method",
            0x03 => "unknown variable",
            0x04 => "local condition failed",
            0x05 => "invalid data",
            0x07 => "buffer overflow",
            0x08 => "buffer underflow",
            0x09 => "unknown type",
            0x0A => "write access denied",
            0x0B => "unknown command for the name server",
            0x0C => "unknown command",
            0x0D => "method server busy",
            0x0E => "array bounds exceeded",
            0x0F => "unknown event",
            0x10 => "value overflow",
            0x11 => "bad character",
            0x12 => "no message",
            0x13 => "no answer message",
            0x14 => "internal error",
            0x15..=0x18 => "wrong hub address",
            0x19 => "asynchronous methods are suppressed",
            0x20 => "complex arrays are not supported",
            _ => "unknown error",
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} ({:X})", self.meaning(), self.0)
    }
}
