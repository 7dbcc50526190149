//! Access to a node's objects: expedited SDO transfers of up to four bytes (CiA 301, 7.2.4).

use super::canopen::{Message, NodeId};
use super::frame::Frame;
use agv_core::measurement::Time;

/// An object, or a part of one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Object {
    /// Index.
    pub index: u16,
    /// Subindex; 0 for a simple object.
    pub sub: u8,
}

impl Object {
    /// The object at `index` and `sub`.
    #[must_use]
    pub const fn new(index: u16, sub: u8) -> Self {
        Self { index, sub }
    }
}

/// A value of one to four bytes, little-endian on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Value {
    bytes: [u8; 4],
    length: u8,
}

impl Value {
    /// The value in those bytes. None unless there are one to four.
    #[must_use]
    pub fn new(bytes: &[u8]) -> Option<Self> {
        if bytes.is_empty() {
            return None;
        }
        let mut four = [0; 4];
        four.get_mut(..bytes.len())?.copy_from_slice(bytes);
        Some(Self { bytes: four, length: bytes.len() as u8 })
    }

    /// The bytes.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.length)).unwrap_or_default()
    }

    /// The value as a number without sign.
    #[must_use]
    pub const fn unsigned(self) -> u32 {
        u32::from_le_bytes(self.bytes)
    }
}

impl From<u8> for Value {
    fn from(value: u8) -> Self {
        Self { bytes: [value, 0, 0, 0], length: 1 }
    }
}

impl From<u16> for Value {
    fn from(value: u16) -> Self {
        let [low, high] = value.to_le_bytes();
        Self { bytes: [low, high, 0, 0], length: 2 }
    }
}

impl From<u32> for Value {
    fn from(value: u32) -> Self {
        Self { bytes: value.to_le_bytes(), length: 4 }
    }
}

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

/// What a master asks of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// Send the value (upload).
    Read(Object),
    /// Take this value (download).
    Write(Object, Value),
    /// The master gives up.
    Abort(Object, AbortCode),
}

/// What a node answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Response {
    /// The value.
    Read(Object, Value),
    /// The value would come in segments: it is longer than four bytes.
    Segmented(Object),
    /// The value has been taken.
    Written(Object),
    /// The node gives up.
    Abort(Object, AbortCode),
}

/// Why eight bytes are no expedited transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SdoError {
    /// The command belongs to segmented or block transfers, or to none.
    Command,
}

mod command {
    pub const WRITE: u8 = 1 << 5;
    pub const READ: u8 = 2 << 5;
    pub const WRITTEN: u8 = 3 << 5;
    pub const ABORT: u8 = 4 << 5;
    pub const SPECIFIER: u8 = 7 << 5;
    pub const EXPEDITED: u8 = 2;
    pub const SIZED: u8 = 1;
}

fn compose(first: u8, object: Object, data: [u8; 4]) -> [u8; 8] {
    let [low, high] = object.index.to_le_bytes();
    let [a, b, c, d] = data;
    [first, low, high, object.sub, a, b, c, d]
}

fn with_value(specifier: u8, object: Object, value: Value) -> [u8; 8] {
    let unused = 4 - value.length;
    compose(specifier | unused << 2 | command::EXPEDITED | command::SIZED, object, value.bytes)
}

/// The value of an expedited transfer; its length is four where it is not said.
fn value_of(first: u8, data: [u8; 4]) -> Value {
    let unused = if first & command::SIZED == 0 { 0 } else { (first >> 2) & 3 };
    let length = 4 - unused;
    let mut bytes = [0; 4];
    for (to, from) in bytes.iter_mut().zip(data).take(usize::from(length)) {
        *to = from;
    }
    Value { bytes, length }
}

impl Request {
    /// The eight bytes of a frame.
    #[must_use]
    pub fn encode(&self) -> [u8; 8] {
        match self {
            Self::Read(object) => compose(command::READ, *object, [0; 4]),
            Self::Write(object, value) => with_value(command::WRITE, *object, *value),
            Self::Abort(object, reason) => compose(command::ABORT, *object, reason.code().to_le_bytes()),
        }
    }

    /// The request in eight bytes.
    ///
    /// # Errors
    /// See [`SdoError`].
    pub fn decode(bytes: [u8; 8]) -> Result<Self, SdoError> {
        let [first, low, high, sub, a, b, c, d] = bytes;
        let object = Object::new(u16::from_le_bytes([low, high]), sub);
        match first & command::SPECIFIER {
            command::READ => Ok(Self::Read(object)),
            command::WRITE if first & command::EXPEDITED != 0 => Ok(Self::Write(object, value_of(first, [a, b, c, d]))),
            command::ABORT => Ok(Self::Abort(object, AbortCode::from_code(u32::from_le_bytes([a, b, c, d])))),
            _ => Err(SdoError::Command),
        }
    }
}

impl Response {
    /// The eight bytes of a frame; a segmented answer is left without its size.
    #[must_use]
    pub fn encode(&self) -> [u8; 8] {
        match self {
            Self::Read(object, value) => with_value(command::READ, *object, *value),
            Self::Segmented(object) => compose(command::READ, *object, [0; 4]),
            Self::Written(object) => compose(command::WRITTEN, *object, [0; 4]),
            Self::Abort(object, reason) => compose(command::ABORT, *object, reason.code().to_le_bytes()),
        }
    }

    /// The response in eight bytes.
    ///
    /// # Errors
    /// See [`SdoError`].
    pub fn decode(bytes: [u8; 8]) -> Result<Self, SdoError> {
        let [first, low, high, sub, a, b, c, d] = bytes;
        let object = Object::new(u16::from_le_bytes([low, high]), sub);
        match first & command::SPECIFIER {
            command::READ if first & command::EXPEDITED != 0 => Ok(Self::Read(object, value_of(first, [a, b, c, d]))),
            command::READ => Ok(Self::Segmented(object)),
            command::WRITTEN => Ok(Self::Written(object)),
            command::ABORT => Ok(Self::Abort(object, AbortCode::from_code(u32::from_le_bytes([a, b, c, d])))),
            _ => Err(SdoError::Command),
        }
    }

    /// The object that the response is about.
    #[must_use]
    pub const fn object(&self) -> Object {
        match self {
            Self::Read(object, _) | Self::Segmented(object) | Self::Written(object) | Self::Abort(object, _) => *object,
        }
    }
}

/// Why a transfer failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TransferError {
    /// The node gave up.
    Aborted(AbortCode),
    /// The node did not answer in time, not even when asked again.
    NoAnswer,
    /// The value is longer than four bytes.
    Segmented,
}

/// What a transfer gave: the value that was read, or none after writing.
pub type TransferResult = Result<Option<Value>, TransferError>;

/// How often a request is sent before the node counts as silent.
const ATTEMPTS: u8 = 3;

#[derive(Clone, Copy, Debug)]
struct Transfer {
    request: Request,
    attempts: u8,
    sent: Option<Time>,
}

/// The master's end of one node's SDO channel: one transfer at a time, repeated if the node does not answer.
#[derive(Clone, Copy, Debug)]
pub struct SdoClient {
    node: NodeId,
    timeout: f64,
    transfer: Option<Transfer>,
}

impl SdoClient {
    /// An idle client that waits `timeout` seconds for each answer.
    #[must_use]
    pub const fn new(node: NodeId, timeout: f64) -> Self {
        Self { node, timeout, transfer: None }
    }

    /// Whether no transfer is under way.
    #[must_use]
    pub const fn is_idle(&self) -> bool {
        self.transfer.is_none()
    }

    /// Begins to read or write; a transfer under way is forgotten.
    pub fn begin(&mut self, request: Request) {
        self.transfer = Some(Transfer { request, attempts: 0, sent: None });
    }

    /// Forgets the transfer under way.
    pub fn cancel(&mut self) {
        self.transfer = None;
    }

    /// The frame to send now, if one is due; or how the transfer ended because no answer came.
    pub fn poll(&mut self, now: Time) -> Result<Option<Frame>, TransferError> {
        let Some(transfer) = &mut self.transfer else { return Ok(None) };
        if transfer.sent.is_some_and(|sent| now.since(sent) < self.timeout) {
            return Ok(None);
        }
        if transfer.attempts >= ATTEMPTS {
            self.transfer = None;
            return Err(TransferError::NoAnswer);
        }
        transfer.attempts += 1;
        transfer.sent = Some(now);
        Ok(Some(Message::SdoRequest { node: self.node, bytes: transfer.request.encode() }.encode()))
    }

    /// When the request that waits for an answer was sent.
    #[must_use]
    pub fn sent(&self) -> Option<Time> {
        self.transfer.and_then(|transfer| transfer.sent)
    }

    /// Takes a response of the node; gives the result if it ends the transfer. What answers no open question is left
    /// alone: it may belong to an earlier attempt or to another master.
    pub fn handle(&mut self, response: &Response) -> Option<TransferResult> {
        let transfer = self.transfer.filter(|transfer| transfer.sent.is_some())?;
        let result = match (transfer.request, *response) {
            (Request::Read(asked), Response::Read(object, value)) if asked == object => Ok(Some(value)),
            (Request::Read(asked), Response::Segmented(object)) if asked == object => Err(TransferError::Segmented),
            (Request::Write(asked, _), Response::Written(object)) if asked == object => Ok(None),
            (Request::Read(asked) | Request::Write(asked, _), Response::Abort(object, reason)) if asked == object => {
                Err(TransferError::Aborted(reason))
            }
            _ => return None,
        };
        self.transfer = None;
        Some(result)
    }
}
