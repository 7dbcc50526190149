//! The packets of a VLP-16 that turns ten times a second, as its manual has them.

use std::f64::consts::TAU;

use agv_lidar3d::packet::{BLOCKS, LENGTH, Packet, RETURNS, Return, Tail};

/// Time between two firings, and between two lasers of one, s.
const FIRING: f64 = 55.296e-6;
const LASER: f64 = 2.304e-6;
/// Lasers.
const LASERS: usize = 16;
/// Turns a second.
pub const FREQUENCY: f64 = 10.0;
/// Time of a packet, s: two firings of each of twelve blocks.
pub const PACKET: f64 = 24.0 * FIRING;

/// The packet whose first firing is at `time`, s, of a head that looks ahead at time 0; `measured` is asked for the return of a laser at
/// an angle of the head, rad, clockwise, and a time.
pub fn packet(time: f64, mut measured: impl FnMut(usize, f64, f64) -> Return) -> [u8; LENGTH] {
    let blocks = std::array::from_fn::<_, BLOCKS, _>(|block| {
        let first = time + 2.0 * FIRING * block as f64;
        // Whole hundredths of a degree are stated.
        let azimuth = (36_000.0 * FREQUENCY * first).round() as u32 % 36_000;
        let returns = std::array::from_fn::<_, RETURNS, _>(|place| {
            let at = first + FIRING * (place / LASERS) as f64 + LASER * (place % LASERS) as f64;
            measured(place % LASERS, TAU * FREQUENCY * at, at)
        });
        (false, azimuth as u16, returns)
    });
    // The strongest returns, of a VLP-16.
    Packet::write(&blocks, Tail([0, 0, 0, 0, 0x37, 0x22]))
}
