//! How much of a bus frames take that come again and again, at worst.

/// Share of the bit rate that what is known of a bus may take: the rest is for services, other nodes, and repetitions.
pub const MOST_LOAD: f64 = 0.6;

/// Bits of a frame with an identifier of eleven bits and so many bytes at most: with all stuff bits that there can be, and
/// the space behind it (Davis, Burns, Bril and Lukkien 2007, "Controller Area Network (CAN) schedulability analysis",
/// equation 1).
#[must_use]
pub const fn longest_frame(bytes: u32) -> u32 {
    let stuffed = 34 + 8 * bytes;
    stuffed + 13 + (stuffed - 1) / 4
}

/// What is sent again and again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cycle {
    /// Frames of each cycle.
    pub frames: u32,
    /// Bytes of each frame.
    pub bytes: u32,
    /// Time from one cycle to the next, s.
    pub period: f64,
}

/// The share of a bus of so many kbit/s that all of it takes.
#[must_use]
pub fn load(cycles: &[Cycle], bit_rate: u16) -> f64 {
    let bits = |cycle: &Cycle| f64::from(cycle.frames * longest_frame(cycle.bytes)) / cycle.period;
    cycles.iter().map(bits).sum::<f64>() / (1000.0 * f64::from(bit_rate))
}
