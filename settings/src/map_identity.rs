//! Which map it is, in one number.

use agv_core::maps::Landmark;

use crate::checksum::CHECKSUM;

/// Bytes of a landmark at most, as it is kept in flash.
const ROOM: usize = 32;

/// The identity of a map: maps that differ in anything have the same one by chance, once in 2^32. It is the sum of the CRC-32 (ISO-HDLC)
/// of the landmarks as they are kept in flash, so their order does not matter. 0 is that of no map.
#[must_use]
pub fn map_identity<'a>(landmarks: impl IntoIterator<Item = &'a Landmark>) -> u32 {
    let of_one = |landmark: &Landmark| {
        let mut room = [0; ROOM];
        // None is longer than there is room for.
        postcard::to_slice(landmark, &mut room).map_or(0, |bytes| CHECKSUM.checksum(bytes))
    };
    let sum = landmarks.into_iter().map(of_one).reduce(u32::wrapping_add);
    sum.map_or(0, |sum| sum.max(1))
}
