//! Messages as bytes: CDR (OMG DDS-RTPS 2.2, section 10) behind the four bytes that state its byte order.

use byteorder::{BigEndian, LittleEndian};
use serde::{Deserialize, Serialize};

/// Plain CDR, little-endian.
const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// Why bytes are not the message that their channel promises.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MessageError {
    /// Another encoding than plain CDR.
    #[error("the message is not encoded in plain CDR")]
    Encapsulation,
    /// The bytes end too early, or a text is none.
    #[error("the message is cut off or damaged")]
    Content,
}

/// A message as bytes.
///
/// # Errors
/// If it holds more than a message can.
pub fn encode<T: Serialize>(message: &T) -> Result<Vec<u8>, MessageError> {
    let body = cdr_encoding::to_vec::<T, LittleEndian>(message).map_err(|_| MessageError::Content)?;
    Ok([&ENCAPSULATION[..], &body].concat())
}

/// The message that bytes hold.
///
/// # Errors
/// If they are of another encoding, or cut off.
pub fn decode<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Result<T, MessageError> {
    let (head, body) = bytes.split_at_checked(ENCAPSULATION.len()).ok_or(MessageError::Content)?;
    let decoded = match head {
        [0, 0, ..] => cdr_encoding::from_bytes::<T, BigEndian>(body),
        [0, 1, ..] => cdr_encoding::from_bytes::<T, LittleEndian>(body),
        _ => return Err(MessageError::Encapsulation),
    };
    decoded.map(|(message, _)| message).map_err(|_| MessageError::Content)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros::messages::{Header, Stamp};

    #[test]
    fn a_header_is_encoded_as_the_standard_says() {
        let header = Header { stamp: Stamp { sec: 1, nanosec: 2 }, frame_id: "map".to_owned() };
        let bytes = encode(&header).unwrap();
        assert_eq!(bytes, b"\0\x01\0\0\x01\0\0\0\x02\0\0\0\x04\0\0\0map\0");
        assert_eq!(decode::<Header>(&bytes).unwrap(), header);
        let big = b"\0\0\0\0\0\0\0\x01\0\0\0\x02\0\0\0\x04map\0";
        assert_eq!(decode::<Header>(big).unwrap(), header);
    }

    #[test]
    fn bytes_of_others_are_refused() {
        for length in 0..18 {
            let bytes = &b"\0\x01\0\0\x01\0\0\0\x02\0\0\0\x04\0\0\0map\0"[..length];
            assert_eq!(decode::<Header>(bytes), Err(MessageError::Content), "{length}");
        }
        assert_eq!(decode::<Header>(b"\0\x07\0\0\x01\0\0\0"), Err(MessageError::Encapsulation));
        // A text that says it is four gigabytes long.
        let hostile = b"\0\x01\0\0\x01\0\0\0\x02\0\0\0\xff\xff\xff\xff";
        assert_eq!(decode::<Header>(hostile), Err(MessageError::Content));
    }
}
