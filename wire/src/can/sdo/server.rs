//! The node's end of a transfer: expedited and segmented (CiA 301, 7.2.4.3). Block transfers are refused, as the standard
//! lets a device do.

use heapless::Vec;

use super::abort_code::AbortCode;
use super::object::Object;

/// Most bytes of a value that is served.
pub const LONGEST_VALUE: usize = 32;

/// The bytes of a value, little-endian.
pub type ValueBytes = Vec<u8, LONGEST_VALUE>;

/// The objects of a node.
pub trait ObjectDictionary {
    /// The value of an object.
    ///
    /// # Errors
    /// Why it cannot be read.
    fn read(&self, object: Object) -> Result<ValueBytes, AbortCode>;

    /// How many bytes a value must have to be written to the object.
    ///
    /// # Errors
    /// Why it cannot be written.
    fn writable(&self, object: Object) -> Result<usize, AbortCode>;

    /// Takes a value of that many bytes.
    ///
    /// # Errors
    /// Why it is not taken; then everything is as before.
    fn write(&mut self, object: Object, bytes: &[u8]) -> Result<(), AbortCode>;
}

/// What is under way.
#[derive(Clone, Debug)]
enum Transfer {
    Upload { object: Object, bytes: ValueBytes, sent: usize, toggle: bool },
    Download { object: Object, bytes: ValueBytes, expected: usize, toggle: bool },
}

/// The server of one node: one transfer at a time. A request to begin another one ends it.
#[derive(Clone, Debug, Default)]
pub struct SdoServer {
    transfer: Option<Transfer>,
}

/// Bytes of a segment.
const SEGMENT: usize = 7;
/// Bytes of an expedited value at most.
const EXPEDITED: usize = 4;
/// Bits of the first byte.
const TOGGLE: u8 = 0x10;
const IS_EXPEDITED: u8 = 2;
const IS_SIZED: u8 = 1;
const IS_LAST: u8 = 1;
/// Command of a master that gives up a transfer.
pub(crate) const GIVE_UP: u8 = 4;

type Reply = Result<[u8; 8], (Object, AbortCode)>;

/// What an abort names that answers a segment of no transfer.
const NOTHING: Object = Object::new(0, 0);

impl SdoServer {
    /// A server without transfer.
    #[must_use]
    pub const fn new() -> Self {
        Self { transfer: None }
    }

    /// Forgets the transfer under way.
    pub fn forget(&mut self) {
        self.transfer = None;
    }

    /// What the node answers to a request.
    pub fn answer(&mut self, dictionary: &mut impl ObjectDictionary, request: [u8; 8]) -> Option<[u8; 8]> {
        let [first, low, high, sub, data @ ..] = request;
        let object = Object::new(u16::from_le_bytes([low, high]), sub);
        let reply = match first >> 5 {
            0 => {
                let [_, segment @ ..] = request;
                self.download_segment(dictionary, first, segment)
            }
            1 => self.download(dictionary, object, first, data),
            2 => self.upload(dictionary, object),
            3 => self.upload_segment(first),
            // It wants no answer.
            GIVE_UP => {
                self.transfer = None;
                return None;
            }
            _ => Err((object, AbortCode::UnknownCommand)),
        };
        Some(reply.unwrap_or_else(|(object, reason)| {
            self.transfer = None;
            abort(object, reason)
        }))
    }

    fn download(&mut self, dictionary: &mut impl ObjectDictionary, object: Object, first: u8, data: [u8; 4]) -> Reply {
        let fail = |reason| (object, reason);
        self.transfer = None;
        let expected = dictionary.writable(object).map_err(fail)?;
        let is_sized = first & IS_SIZED != 0;
        if first & IS_EXPEDITED == 0 {
            if is_sized && u32::from_le_bytes(data) as usize != expected {
                return Err(fail(AbortCode::LengthMismatch));
            }
            self.transfer = Some(Transfer::Download { object, bytes: ValueBytes::new(), expected, toggle: false });
            return Ok(compose(0x60, object, [0; 4]));
        }
        // Without a length the value is as long as the object.
        let length = if is_sized { EXPEDITED - usize::from(first >> 2 & 3) } else { expected };
        let bytes = data.get(..length).filter(|_| length == expected).ok_or(fail(AbortCode::LengthMismatch))?;
        dictionary.write(object, bytes).map_err(fail)?;
        Ok(compose(0x60, object, [0; 4]))
    }

    fn download_segment(&mut self, dictionary: &mut impl ObjectDictionary, first: u8, segment: [u8; 7]) -> Reply {
        let Some(Transfer::Download { object, bytes, expected, toggle }) = &mut self.transfer else {
            return Err((NOTHING, AbortCode::UnknownCommand));
        };
        let (object, expected) = (*object, *expected);
        let fail = |reason| (object, reason);
        if (first & TOGGLE != 0) != *toggle {
            return Err(fail(AbortCode::ToggleBit));
        }
        let piece = segment.get(..SEGMENT - usize::from(first >> 1 & 7)).unwrap_or_default();
        if bytes.len() + piece.len() > expected || bytes.extend_from_slice(piece).is_err() {
            return Err(fail(AbortCode::LengthMismatch));
        }
        let answer = 0x20 | if *toggle { TOGGLE } else { 0 };
        *toggle = !*toggle;
        if first & IS_LAST != 0 {
            let bytes = core::mem::take(bytes);
            self.transfer = None;
            if bytes.len() != expected {
                return Err(fail(AbortCode::LengthMismatch));
            }
            dictionary.write(object, &bytes).map_err(fail)?;
        }
        Ok([answer, 0, 0, 0, 0, 0, 0, 0])
    }

    fn upload(&mut self, dictionary: &impl ObjectDictionary, object: Object) -> Reply {
        self.transfer = None;
        let bytes = dictionary.read(object).map_err(|reason| (object, reason))?;
        if (1..=EXPEDITED).contains(&bytes.len()) {
            let mut data = [0; EXPEDITED];
            for (to, from) in data.iter_mut().zip(&bytes) {
                *to = *from;
            }
            let unused = (EXPEDITED - bytes.len()) as u8;
            return Ok(compose(0x40 | unused << 2 | IS_EXPEDITED | IS_SIZED, object, data));
        }
        let length = (bytes.len() as u32).to_le_bytes();
        self.transfer = Some(Transfer::Upload { object, bytes, sent: 0, toggle: false });
        Ok(compose(0x40 | IS_SIZED, object, length))
    }

    fn upload_segment(&mut self, first: u8) -> Reply {
        let Some(Transfer::Upload { object, bytes, sent, toggle }) = &mut self.transfer else {
            return Err((NOTHING, AbortCode::UnknownCommand));
        };
        if (first & TOGGLE != 0) != *toggle {
            return Err((*object, AbortCode::ToggleBit));
        }
        let rest = bytes.get(*sent..).unwrap_or_default();
        let count = rest.len().min(SEGMENT);
        let is_last = rest.len() <= SEGMENT;
        let unused = ((SEGMENT - count) as u8) << 1;
        let mut answer = [0; 8];
        let [command, segment @ ..] = &mut answer;
        *command = if *toggle { TOGGLE } else { 0 } | unused | if is_last { IS_LAST } else { 0 };
        for (to, from) in segment.iter_mut().zip(rest) {
            *to = *from;
        }
        *sent += count;
        *toggle = !*toggle;
        if is_last {
            self.transfer = None;
        }
        Ok(answer)
    }
}

/// The answer to a transfer that is given up.
pub(crate) fn abort(object: Object, reason: AbortCode) -> [u8; 8] {
    compose(0x80, object, reason.code().to_le_bytes())
}

fn compose(first: u8, object: Object, data: [u8; 4]) -> [u8; 8] {
    let [low, high] = object.index.to_le_bytes();
    let [a, b, c, d] = data;
    [first, low, high, object.sub, a, b, c, d]
}
