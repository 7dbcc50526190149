//! Requests and responses as the eight bytes of a frame.

use super::abort_code::AbortCode;
use super::object::{Object, Value};

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
