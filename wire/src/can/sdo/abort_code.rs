//! Reasons to give up a transfer, as numbers.

/// Why a node or its master gave up a transfer (CiA 301, table 22).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AbortCode {
    /// Toggle bit not alternated.
    ToggleBit,
    /// SDO protocol timed out.
    TimedOut,
    /// Command specifier not valid or unknown.
    UnknownCommand,
    /// Invalid block size.
    BlockSize,
    /// Invalid sequence number.
    SequenceNumber,
    /// CRC error.
    Checksum,
    /// Out of memory.
    OutOfMemory,
    /// Unsupported access to an object.
    UnsupportedAccess,
    /// Attempt to read a write-only object.
    WriteOnly,
    /// Attempt to write a read-only object.
    ReadOnly,
    /// Object does not exist.
    NoSuchObject,
    /// Object cannot be mapped to the PDO.
    NotMappable,
    /// Mapped objects would exceed the PDO length.
    PdoLength,
    /// General parameter incompatibility.
    ParameterIncompatible,
    /// General internal incompatibility in the device.
    InternalIncompatible,
    /// Access failed because of a hardware error.
    Hardware,
    /// Length of the parameter does not match.
    LengthMismatch,
    /// Length of the parameter too high.
    TooLong,
    /// Length of the parameter too low.
    TooShort,
    /// Subindex does not exist.
    NoSuchSubindex,
    /// Invalid value for the parameter.
    InvalidValue,
    /// Value of the parameter too high.
    ValueTooHigh,
    /// Value of the parameter too low.
    ValueTooLow,
    /// Maximum less than minimum.
    MaximumBelowMinimum,
    /// Resource not available: SDO connection.
    NoConnection,
    /// General error.
    General,
    /// Data cannot be transferred or stored.
    CannotStore,
    /// Data cannot be transferred or stored because of local control.
    LocalControl,
    /// Data cannot be transferred or stored because of the present device state.
    DeviceState,
    /// Object dictionary not present.
    NoDictionary,
    /// No data available.
    NoData,
    /// A code that the standard does not list.
    Other(u32),
}

const ABORT_CODES: [(u32, AbortCode); 31] = [
    (0x0503_0000, AbortCode::ToggleBit),
    (0x0504_0000, AbortCode::TimedOut),
    (0x0504_0001, AbortCode::UnknownCommand),
    (0x0504_0002, AbortCode::BlockSize),
    (0x0504_0003, AbortCode::SequenceNumber),
    (0x0504_0004, AbortCode::Checksum),
    (0x0504_0005, AbortCode::OutOfMemory),
    (0x0601_0000, AbortCode::UnsupportedAccess),
    (0x0601_0001, AbortCode::WriteOnly),
    (0x0601_0002, AbortCode::ReadOnly),
    (0x0602_0000, AbortCode::NoSuchObject),
    (0x0604_0041, AbortCode::NotMappable),
    (0x0604_0042, AbortCode::PdoLength),
    (0x0604_0043, AbortCode::ParameterIncompatible),
    (0x0604_0047, AbortCode::InternalIncompatible),
    (0x0606_0000, AbortCode::Hardware),
    (0x0607_0010, AbortCode::LengthMismatch),
    (0x0607_0012, AbortCode::TooLong),
    (0x0607_0013, AbortCode::TooShort),
    (0x0609_0011, AbortCode::NoSuchSubindex),
    (0x0609_0030, AbortCode::InvalidValue),
    (0x0609_0031, AbortCode::ValueTooHigh),
    (0x0609_0032, AbortCode::ValueTooLow),
    (0x0609_0036, AbortCode::MaximumBelowMinimum),
    (0x060A_0023, AbortCode::NoConnection),
    (0x0800_0000, AbortCode::General),
    (0x0800_0020, AbortCode::CannotStore),
    (0x0800_0021, AbortCode::LocalControl),
    (0x0800_0022, AbortCode::DeviceState),
    (0x0800_0023, AbortCode::NoDictionary),
    (0x0800_0024, AbortCode::NoData),
];

impl AbortCode {
    /// The reason with that code.
    #[must_use]
    pub fn from_code(code: u32) -> Self {
        ABORT_CODES.iter().find(|(known, _)| *known == code).map_or(Self::Other(code), |(_, reason)| *reason)
    }

    /// The code.
    #[must_use]
    pub fn code(self) -> u32 {
        match self {
            Self::Other(code) => code,
            _ => ABORT_CODES.iter().find(|(_, reason)| *reason == self).map_or(0x0800_0000, |(code, _)| *code),
        }
    }
}
