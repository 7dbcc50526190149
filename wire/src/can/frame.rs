//! Frames of classic CAN and of CAN FD (ISO 11898-1).

pub use embedded_can::{ExtendedId, Id, StandardId};

/// Bytes that a classic frame can carry.
pub const CLASSIC_LENGTH: usize = 8;
/// Bytes that an FD frame can carry.
pub const FD_LENGTH: usize = 64;

/// The identifier of 11 bits with that number; higher bits are cut off.
#[must_use]
pub const fn standard_id(number: u16) -> Id {
    match StandardId::new(number & 0x7FF) {
        Some(id) => Id::Standard(id),
        None => Id::Standard(StandardId::ZERO),
    }
}

/// The identifier of 29 bits with that number; higher bits are cut off.
#[must_use]
pub const fn extended_id(number: u32) -> Id {
    match ExtendedId::new(number & 0x1FFF_FFFF) {
        Some(id) => Id::Extended(id),
        None => Id::Extended(ExtendedId::ZERO),
    }
}

/// A classic frame: data of 0 to 8 bytes, or a request for them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Frame {
    id: Id,
    is_remote: bool,
    length: u8,
    // Zero behind `length`, so that equal frames are equal values.
    data: [u8; CLASSIC_LENGTH],
}

impl Frame {
    /// A data frame. None if the data are longer than 8 bytes.
    #[must_use]
    pub fn new(id: impl Into<Id>, data: &[u8]) -> Option<Self> {
        let mut bytes = [0; CLASSIC_LENGTH];
        bytes.get_mut(..data.len())?.copy_from_slice(data);
        Some(Self { id: id.into(), is_remote: false, length: data.len() as u8, data: bytes })
    }

    /// A data frame of a length that is known to fit.
    #[must_use]
    pub fn of<const N: usize>(id: impl Into<Id>, data: [u8; N]) -> Self {
        const { assert!(N <= CLASSIC_LENGTH) }
        let mut bytes = [0; CLASSIC_LENGTH];
        for (to, from) in bytes.iter_mut().zip(data) {
            *to = from;
        }
        Self { id: id.into(), is_remote: false, length: N as u8, data: bytes }
    }

    /// A request for `length` bytes. None if that is more than 8.
    #[must_use]
    pub fn remote(id: impl Into<Id>, length: usize) -> Option<Self> {
        if length > CLASSIC_LENGTH {
            return None;
        }
        Some(Self { id: id.into(), is_remote: true, length: length as u8, data: [0; CLASSIC_LENGTH] })
    }

    /// The identifier.
    #[must_use]
    pub const fn id(&self) -> Id {
        self.id
    }

    /// Whether the frame asks for data instead of carrying them.
    #[must_use]
    pub const fn is_remote(&self) -> bool {
        self.is_remote
    }

    /// The data; none in a request.
    #[must_use]
    pub fn data(&self) -> &[u8] {
        let length = if self.is_remote { 0 } else { usize::from(self.length) };
        self.data.get(..length).unwrap_or_default()
    }

    /// How many bytes the frame carries or asks for.
    #[must_use]
    pub const fn length(&self) -> usize {
        self.length as usize
    }

    /// The data filled up with zeros.
    #[must_use]
    pub const fn padded(&self) -> [u8; CLASSIC_LENGTH] {
        self.data
    }
}

impl embedded_can::Frame for Frame {
    fn new(id: impl Into<Id>, data: &[u8]) -> Option<Self> {
        Self::new(id, data)
    }

    fn new_remote(id: impl Into<Id>, dlc: usize) -> Option<Self> {
        Self::remote(id, dlc)
    }

    fn is_extended(&self) -> bool {
        matches!(self.id, Id::Extended(_))
    }

    fn is_remote_frame(&self) -> bool {
        self.is_remote
    }

    fn id(&self) -> Id {
        self.id
    }

    fn dlc(&self) -> usize {
        self.length()
    }

    fn data(&self) -> &[u8] {
        self.data()
    }
}

/// A frame of CAN FD: up to 64 bytes, of which only some numbers are possible.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct FdFrame {
    id: Id,
    is_fast: bool,
    length: u8,
    data: [u8; FD_LENGTH],
}

/// Length in bytes for each data length code (ISO 11898-1).
const FD_LENGTHS: [u8; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64];

impl FdFrame {
    /// A frame whose data are sent at the faster bit rate if `is_fast` (bit rate switch). None if an FD frame cannot have
    /// that length: it is 0 to 8, 12, 16, 20, 24, 32, 48 or 64.
    #[must_use]
    pub fn new(id: impl Into<Id>, data: &[u8], is_fast: bool) -> Option<Self> {
        let length = u8::try_from(data.len()).ok().filter(|length| FD_LENGTHS.contains(length))?;
        let mut bytes = [0; FD_LENGTH];
        bytes.get_mut(..data.len())?.copy_from_slice(data);
        Some(Self { id: id.into(), is_fast, length, data: bytes })
    }

    /// Length in bytes of frames with that data length code. None above 15.
    #[must_use]
    pub fn length_of_code(code: u8) -> Option<usize> {
        FD_LENGTHS.get(usize::from(code)).map(|length| usize::from(*length))
    }

    /// The data length code, 0 to 15.
    #[must_use]
    pub fn length_code(&self) -> u8 {
        FD_LENGTHS.iter().position(|length| *length == self.length).unwrap_or(0) as u8
    }

    /// The identifier.
    #[must_use]
    pub const fn id(&self) -> Id {
        self.id
    }

    /// Whether the data are sent at the faster bit rate.
    #[must_use]
    pub const fn is_fast(&self) -> bool {
        self.is_fast
    }

    /// The data.
    #[must_use]
    pub fn data(&self) -> &[u8] {
        self.data.get(..usize::from(self.length)).unwrap_or_default()
    }
}

/// A frame of either kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AnyFrame {
    /// Classic CAN.
    Classic(Frame),
    /// CAN FD.
    Fd(FdFrame),
}

impl AnyFrame {
    /// The identifier.
    #[must_use]
    pub const fn id(&self) -> Id {
        match self {
            Self::Classic(frame) => frame.id(),
            Self::Fd(frame) => frame.id(),
        }
    }

    /// The data; none in a request.
    #[must_use]
    pub fn data(&self) -> &[u8] {
        match self {
            Self::Classic(frame) => frame.data(),
            Self::Fd(frame) => frame.data(),
        }
    }

    /// The frame if it is a classic one.
    #[must_use]
    pub const fn classic(&self) -> Option<&Frame> {
        match self {
            Self::Classic(frame) => Some(frame),
            Self::Fd(_) => None,
        }
    }
}

impl From<Frame> for AnyFrame {
    fn from(frame: Frame) -> Self {
        Self::Classic(frame)
    }
}

impl From<FdFrame> for AnyFrame {
    fn from(frame: FdFrame) -> Self {
        Self::Fd(frame)
    }
}
