//! What the sensor is doing, and who may change it.

use core::fmt;

use crate::cola::{ReadError, Reader, WriteError, Writer};

/// What the sensor is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OperatingMode {
    /// The head does not turn.
    PowerDown,
    /// Settings and the layout may be changed.
    Standby,
    /// Positions of reflectors are measured from a known pose.
    Mapping,
    /// Reflectors are reported without a pose.
    LandmarkDetection,
    /// Poses are reported.
    Navigation,
}

impl OperatingMode {
    const ALL: [Self; 5] = [Self::PowerDown, Self::Standby, Self::Mapping, Self::LandmarkDetection, Self::Navigation];

    /// Reads a mode.
    ///
    /// # Errors
    /// If there is no mode of that number.
    pub fn read(reader: &mut Reader) -> Result<Self, ReadError> {
        let number = reader.u8()?;
        Self::ALL.get(usize::from(number)).copied().ok_or(ReadError::Value)
    }

    /// Writes the mode.
    ///
    /// # Errors
    /// If the buffer is full.
    pub fn write(self, writer: &mut Writer) -> Result<(), WriteError> {
        writer.u8(self as u8)
    }
}

impl fmt::Display for OperatingMode {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::PowerDown => "power down",
            Self::Standby => "standby",
            Self::Mapping => "mapping",
            Self::LandmarkDetection => "landmark detection",
            Self::Navigation => "navigation",
        })
    }
}

/// Who the host is. Source of the words of access: SICK's public driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UserLevel {
    /// May read.
    Maintenance,
    /// May change settings, modes and the layout.
    AuthorisedClient,
    /// The maker.
    Service,
}

impl UserLevel {
    /// The level's number.
    #[must_use]
    pub const fn number(self) -> u8 {
        match self {
            Self::Maintenance => 2,
            Self::AuthorisedClient => 3,
            Self::Service => 4,
        }
    }

    /// The word of access that sensors are delivered with.
    #[must_use]
    pub const fn default_password(self) -> u32 {
        match self {
            Self::Maintenance => 0xB21A_CE26,
            Self::AuthorisedClient => 0xF472_4744,
            Self::Service => 0x81BE_23AA,
        }
    }
}

/// How a method ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ErrorCode(pub u8);

impl ErrorCode {
    /// All is well.
    pub const OK: Self = Self(0);
    /// The method needs another operating mode.
    pub const WRONG_MODE: Self = Self(1);
    /// The arguments make no sense.
    pub const INVALID_DATA: Self = Self(3);
    /// There is no pose; reflectors and scan are valid all the same.
    pub const NO_POSITION: Self = Self(4);
    /// The sensor has waited too long.
    pub const TIMEOUT: Self = Self(5);
    /// The method has not ended since it was called last.
    pub const ALREADY_ACTIVE: Self = Self(6);

    /// What the number means.
    #[must_use]
    pub const fn meaning(self) -> &'static str {
        match self.0 {
            0 => "no error",
            1 => "wrong operating mode",
            2 => "asynchronous method terminated",
            3 => "invalid data",
            4 => "no position available",
            5 => "timeout",
            6 => "method already active",
            7 => "general error",
            _ => "unknown error",
        }
    }

    pub(super) fn read(reader: &mut Reader) -> Result<Self, ReadError> {
        reader.u8().map(Self)
    }

    pub(super) fn write(self, writer: &mut Writer) -> Result<(), WriteError> {
        writer.u8(self.0)
    }
}

impl fmt::Display for ErrorCode {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} ({})", self.meaning(), self.0)
    }
}
