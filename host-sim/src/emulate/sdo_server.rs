//! The node's end of SDO transfers: expedited and segmented (CiA 301, 7.2.4.3). Block transfers are refused as the standard
//! lets a device refuse them, with an abort.

use agv_wire::can::sdo::{AbortCode, Object};

/// The objects of a node.
pub(super) trait Dictionary {
    /// The bytes of an object, little-endian.
    fn read(&self, object: Object) -> Result<Vec<u8>, AbortCode>;
    /// Whether the object can be written at all, and with so many bytes, if their number is known.
    fn check_write(&self, object: Object, length: Option<usize>) -> Result<(), AbortCode>;
    /// Takes the bytes of an object.
    fn write(&mut self, object: Object, bytes: &[u8]) -> Result<(), AbortCode>;
}

/// A transfer in segments that is under way.
#[derive(Clone, Debug)]
enum Transfer {
    Upload { object: Object, rest: Vec<u8>, toggle: bool },
    Download { object: Object, bytes: Vec<u8>, toggle: bool },
}

/// The server of one node.
#[derive(Clone, Debug, Default)]
pub(super) struct SdoServer {
    transfer: Option<Transfer>,
}

/// Bytes of a segment.
const SEGMENT: usize = 7;
/// More than any object has.
const LONGEST: usize = 1024;

type Reply = Result<[u8; 8], (Object, AbortCode)>;

impl SdoServer {
    /// What the node answers to a request.
    pub(super) fn answer(&mut self, dictionary: &mut impl Dictionary, request: [u8; 8]) -> Option<[u8; 8]> {
        let [first, low, high, sub, data @ ..] = request;
        let object = Object::new(u16::from_le_bytes([low, high]), sub);
        let reply = match first >> 5 {
            0 => self.download_segment(dictionary, first, &request[1..]),
            1 => self.download(dictionary, object, first, data),
            2 => self.upload(dictionary, object),
            3 => self.upload_segment(first),
            // The master gives up, and wants no answer.
            4 => {
                self.transfer = None;
                return None;
            }
            _ => Err((object, AbortCode::UnknownCommand)),
        };
        Some(reply.unwrap_or_else(|(object, reason)| {
            self.transfer = None;
            compose(0x80, object, reason.code().to_le_bytes())
        }))
    }

    fn download(&mut self, dictionary: &mut impl Dictionary, object: Object, first: u8, data: [u8; 4]) -> Reply {
        let fail = |reason| (object, reason);
        let (is_expedited, is_sized) = (first & 2 != 0, first & 1 != 0);
        self.transfer = None;
        if is_expedited {
            let length = if is_sized { 4 - usize::from(first >> 2 & 3) } else { 4 };
            dictionary.check_write(object, Some(length)).map_err(fail)?;
            dictionary.write(object, &data[..length]).map_err(fail)?;
        } else {
            let length = is_sized.then(|| u32::from_le_bytes(data) as usize);
            dictionary.check_write(object, length).map_err(fail)?;
            self.transfer = Some(Transfer::Download { object, bytes: Vec::new(), toggle: false });
        }
        Ok(compose(0x60, object, [0; 4]))
    }

    fn download_segment(&mut self, dictionary: &mut impl Dictionary, first: u8, data: &[u8]) -> Reply {
        let Some(Transfer::Download { object, bytes, toggle }) = &mut self.transfer else {
            return Err((Object::new(0, 0), AbortCode::UnknownCommand));
        };
        let object = *object;
        let fail = |reason| (object, reason);
        if (first & 0x10 != 0) != *toggle {
            return Err(fail(AbortCode::ToggleBit));
        }
        bytes.extend_from_slice(&data[..SEGMENT - usize::from(first >> 1 & 7)]);
        if bytes.len() > LONGEST {
            return Err(fail(AbortCode::OutOfMemory));
        }
        let answer = 0x20 | u8::from(*toggle) << 4;
        *toggle = !*toggle;
        if first & 1 != 0 {
            let bytes = std::mem::take(bytes);
            self.transfer = None;
            dictionary.check_write(object, Some(bytes.len())).map_err(fail)?;
            dictionary.write(object, &bytes).map_err(fail)?;
        }
        Ok([answer, 0, 0, 0, 0, 0, 0, 0])
    }

    fn upload(&mut self, dictionary: &impl Dictionary, object: Object) -> Reply {
        let bytes = dictionary.read(object).map_err(|reason| (object, reason))?;
        self.transfer = None;
        if (1..=4).contains(&bytes.len()) {
            let mut data = [0; 4];
            data[..bytes.len()].copy_from_slice(&bytes);
            return Ok(compose(0x43 | (4 - bytes.len() as u8) << 2, object, data));
        }
        let length = (bytes.len() as u32).to_le_bytes();
        self.transfer = Some(Transfer::Upload { object, rest: bytes, toggle: false });
        Ok(compose(0x41, object, length))
    }

    fn upload_segment(&mut self, first: u8) -> Reply {
        let Some(Transfer::Upload { object, rest, toggle }) = &mut self.transfer else {
            return Err((Object::new(0, 0), AbortCode::UnknownCommand));
        };
        if (first & 0x10 != 0) != *toggle {
            return Err((*object, AbortCode::ToggleBit));
        }
        let count = rest.len().min(SEGMENT);
        let is_last = rest.len() <= SEGMENT;
        let mut answer = [0; 8];
        answer[0] = u8::from(*toggle) << 4 | ((SEGMENT - count) as u8) << 1 | u8::from(is_last);
        answer[1..=count].copy_from_slice(&rest[..count]);
        rest.drain(..count);
        *toggle = !*toggle;
        if is_last {
            self.transfer = None;
        }
        Ok(answer)
    }
}

fn compose(first: u8, object: Object, data: [u8; 4]) -> [u8; 8] {
    let [low, high] = object.index.to_le_bytes();
    let [a, b, c, d] = data;
    [first, low, high, object.sub, a, b, c, d]
}
