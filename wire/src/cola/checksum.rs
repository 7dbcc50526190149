//! The check byte of CoLa-B.

/// Exclusive or of all bytes.
pub(super) fn exclusive_or(bytes: &[u8]) -> u8 {
    // Words first: a scan has nine thousand bytes.
    let (words, rest) = bytes.as_chunks::<8>();
    let word = words.iter().fold(0, |sum, word| sum ^ u64::from_ne_bytes(*word));
    let sum = word.to_ne_bytes().iter().fold(0, |sum, byte| sum ^ byte);
    rest.iter().fold(sum, |sum, byte| sum ^ byte)
}
