//! Messages in a stream of bytes.

use serde::Serialize;

use super::authentication::TAG;

/// Longest message with its length and its tag, bytes: a piece of a map.
pub const LONGEST_MESSAGE: usize = 1536;

const LENGTH: usize = 2;

/// Why bytes are no message, or a message no bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MessageError;

/// Puts a message into `room`, with a tag of its bytes if there is one; gives its length.
///
/// # Errors
/// If there is not enough room.
pub fn encode(
    message: &impl Serialize,
    tag: impl FnOnce(&[u8]) -> Option<[u8; TAG]>,
    room: &mut [u8],
) -> Result<usize, MessageError> {
    let body = room.get_mut(LENGTH..).ok_or(MessageError)?;
    let mut length = postcard::to_slice(message, body).map_err(|_| MessageError)?.len();
    if let Some(tag) = tag(body.get(..length).unwrap_or_default()) {
        body.get_mut(length..length + TAG).ok_or(MessageError)?.copy_from_slice(&tag);
        length += TAG;
    }
    let stated = u16::try_from(length).map_err(|_| MessageError)?.to_le_bytes();
    room.get_mut(..LENGTH).ok_or(MessageError)?.copy_from_slice(&stated);
    Ok(LENGTH + length)
}

/// Finds messages in what arrives.
pub struct Frames {
    bytes: [u8; LONGEST_MESSAGE],
    filled: usize,
}

impl Frames {
    /// Nothing has arrived.
    #[must_use]
    pub const fn new() -> Self {
        Self { bytes: [0; LONGEST_MESSAGE], filled: 0 }
    }

    /// Forgets everything.
    pub const fn clear(&mut self) {
        self.filled = 0;
    }

    /// Takes bytes up to the end of a message; gives how many, and whether [`Self::message`] is whole.
    ///
    /// # Errors
    /// If a message is longer than any. The connection is of no more use.
    pub fn push(&mut self, bytes: &[u8]) -> Result<(usize, bool), MessageError> {
        let mut taken = 0;
        loop {
            let stated = match self.bytes.get(..self.filled) {
                Some([low, high, ..]) => Some(usize::from(u16::from_le_bytes([*low, *high]))),
                _ => None,
            };
            let wanted = LENGTH + stated.unwrap_or(0);
            if wanted > LONGEST_MESSAGE {
                return Err(MessageError);
            }
            if stated.is_some() && self.filled == wanted {
                return Ok((taken, true));
            }
            let rest = bytes.get(taken..).unwrap_or_default();
            let count = rest.len().min(wanted - self.filled);
            if count == 0 {
                return Ok((taken, false));
            }
            if let (Some(to), Some(from)) = (self.bytes.get_mut(self.filled..self.filled + count), rest.get(..count)) {
                to.copy_from_slice(from);
            }
            self.filled += count;
            taken += count;
        }
    }

    /// The message that is whole, without its length.
    #[must_use]
    pub fn message(&self) -> &[u8] {
        self.bytes.get(LENGTH..self.filled).unwrap_or_default()
    }
}

impl Default for Frames {
    fn default() -> Self {
        Self::new()
    }
}
