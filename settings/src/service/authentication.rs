//! Who may change something: challenge and response with HMAC-SHA256 (RFC 2104, FIPS 180-4).
//!
//! The controller says a nonce that no other connection has. Each change carries the code of nonce, running number and
//! request under the key that both sides were given, so that neither a recorded change nor one in another order is taken.
//! The key is never sent.

use hmac::{Hmac, KeyInit, Mac};
use sha2::Sha256;

use crate::store::KEY;

/// Bytes of a tag.
pub const TAG: usize = 32;

/// What makes the tags of a connection different from all others.
pub type Nonce = [u8; 16];

fn code(key: &[u8; KEY]) -> Option<Hmac<Sha256>> {
    // A key may have any length, so this does not fail.
    Hmac::new_from_slice(key).ok()
}

/// A nonce from numbers that do not come together a second time: how often the controller was started, how often it was
/// asked since, and its clock. Without the key nobody knows it before it is said.
#[must_use]
pub fn nonce(key: &[u8; KEY], starts: u32, asked: u32, microseconds: u64) -> Nonce {
    let mut nonce = [0; 16];
    if let Some(mut code) = code(key) {
        code.update(b"nonce");
        code.update(&starts.to_le_bytes());
        code.update(&asked.to_le_bytes());
        code.update(&microseconds.to_le_bytes());
        for (place, byte) in nonce.iter_mut().zip(code.finalize().into_bytes()) {
            *place = byte;
        }
    }
    nonce
}

/// The code that a change is given or held against.
fn change(key: &[u8; KEY], nonce: &Nonce, number: u32, request: &[u8]) -> Option<Hmac<Sha256>> {
    let mut code = code(key)?;
    code.update(b"change");
    code.update(nonce);
    code.update(&number.to_le_bytes());
    code.update(request);
    Some(code)
}

/// The tag of the change with that running number, from 0, on the connection with that nonce.
#[must_use]
pub fn tag(key: &[u8; KEY], nonce: &Nonce, number: u32, request: &[u8]) -> [u8; TAG] {
    change(key, nonce, number, request).map_or([0; TAG], |code| code.finalize().into_bytes().into())
}

/// Whether a tag is right. Takes the same time whatever is wrong with it.
#[must_use]
pub fn is_right(key: &[u8; KEY], nonce: &Nonce, number: u32, request: &[u8], tag: &[u8]) -> bool {
    change(key, nonce, number, request).is_some_and(|code| code.verify_slice(tag).is_ok())
}
