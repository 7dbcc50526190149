//! Ranges as the packets of an HDL-64E.

use agv_lidar3d::packet::{BLOCKS, LENGTH, Packet, RETURNS, Return, Tail};

/// Lasers of an HDL-64E.
const LASERS: usize = 2 * RETURNS;
/// Firings of all lasers in a packet: each one is two blocks.
const FIRINGS: usize = BLOCKS / 2;

/// Packs counts of distance as an HDL-64E S2 sends them, but all returns of a firing at the angle that is stated. `azimuths`
/// are the angles of the head, 0.01 degrees; `count` is asked for the distance at a column and of a laser. A last packet that
/// is not full is filled with firings in which nothing is seen.
pub fn hdl64e_packets(azimuths: &[u16], count: impl Fn(usize, usize) -> u16) -> Vec<[u8; LENGTH]> {
    let packets = azimuths.chunks(FIRINGS).enumerate().map(|(number, firings)| {
        let blocks = std::array::from_fn::<_, BLOCKS, _>(|block| {
            let (firing, is_lower) = (block / 2, block % 2 == 1);
            let azimuth = firings.get(firing).or(firings.last()).copied().unwrap_or(0);
            let returns = std::array::from_fn::<_, RETURNS, _>(|place| {
                let laser = if is_lower { LASERS / 2 + place } else { place };
                let distance = if firing < firings.len() { count(number * FIRINGS + firing, laser) } else { 0 };
                Return { distance, intensity: 0 }
            });
            (is_lower, azimuth, returns)
        });
        Packet::write(&blocks, Tail::AT_ONCE)
    });
    packets.collect()
}
