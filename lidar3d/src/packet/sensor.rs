//! The sensors that send these packets.

use super::{BLOCKS, Packet, RETURNS, counts_between};

const HDL32E_ELEVATIONS: [f64; 32] = [
    -30.67, -9.33, -29.33, -8.0, -28.0, -6.67, -26.67, -5.33, -25.33, -4.0, -24.0, -2.67, -22.67, -1.33, -21.33, 0.0,
    -20.0, 1.33, -18.67, 2.67, -17.33, 4.0, -16.0, 5.33, -14.67, 6.67, -13.33, 8.0, -12.0, 9.33, -10.67, 10.67,
];
const VLP16_ELEVATIONS: [f64; 16] =
    [-15.0, 1.0, -13.0, 3.0, -11.0, 5.0, -9.0, 7.0, -7.0, 9.0, -5.0, 11.0, -3.0, 13.0, -1.0, 15.0];

/// A kind of sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sensor {
    /// HDL-64E, S1, S2 and S3: two groups of 32 lasers, one block each.
    Hdl64e,
    /// HDL-32E: one firing of 32 lasers a block.
    Hdl32e,
    /// VLP-16: two firings of 16 lasers a block.
    Vlp16,
}

impl Sensor {
    /// The sensor that sends such packets: only an HDL-64E has lower lasers; HDL-32E and VLP-16 state what they are in the
    /// last byte. None for a packet of upper blocks alone that states nothing.
    #[must_use]
    pub fn of_packet(packet: &Packet<'_>) -> Option<Self> {
        if packet.blocks().any(|block| block.is_lower()) {
            return Some(Self::Hdl64e);
        }
        let is_return_mode = |mode| (0x37..=0x39).contains(&mode);
        match packet.tail().status() {
            (mode, 0x21) if is_return_mode(mode) => Some(Self::Hdl32e),
            (mode, 0x22) if is_return_mode(mode) => Some(Self::Vlp16),
            _ => None,
        }
    }

    /// Elevation of each laser where all sensors of the kind have the same, deg (manuals); None for an HDL-64E, each of
    /// which has its own calibration.
    #[must_use]
    pub fn elevations(self) -> Option<&'static [f64]> {
        match self {
            Self::Hdl64e => None,
            Self::Hdl32e => Some(&HDL32E_ELEVATIONS),
            Self::Vlp16 => Some(&VLP16_ELEVATIONS),
        }
    }

    /// Number of lasers.
    #[must_use]
    pub const fn lasers(self) -> usize {
        match self {
            Self::Hdl64e => 64,
            Self::Hdl32e => 32,
            Self::Vlp16 => 16,
        }
    }

    /// Length of one count of distance, m.
    #[must_use]
    pub const fn distance_resolution(self) -> f32 {
        0.002
    }

    /// Number of the laser whose return stands at a place of a block.
    pub(super) const fn laser(self, is_lower: bool, place: usize) -> usize {
        match self {
            Self::Hdl64e if is_lower => RETURNS + place,
            Self::Hdl64e | Self::Hdl32e => place,
            Self::Vlp16 => place % 16,
        }
    }

    /// By how many hundredths of a degree the head turns in how many blocks, over a whole packet. None for an HDL-64E,
    /// which states the angle of each of its groups. In dual return mode two blocks in turn are of the same firing.
    pub(super) fn step(self, packet: &Packet<'_>) -> Option<(u32, u32)> {
        const DUAL_RETURN: u8 = 0x39;
        if self == Self::Hdl64e {
            return None;
        }
        let firings = if packet.tail().status().0 == DUAL_RETURN { BLOCKS / 2 } else { BLOCKS };
        let (first, last) = (packet.azimuth(0)?, packet.azimuth(BLOCKS - 1)?);
        Some((u32::from(counts_between(first, last)), firings as u32 - 1))
    }

    /// Which share of the way to the next block's angle the head has turned when a return of a block is measured, in
    /// 1/1000. From the firing tables of the manuals: HDL-32E 1.152 us a laser, 46.08 us a firing; VLP-16 2.304 us a
    /// laser, 55.296 us a firing. The HDL-64E states the angle of a group.
    pub(super) const fn firing_permille(self, position: usize) -> u32 {
        let position = position as u32;
        match self {
            Self::Hdl64e => 0,
            Self::Hdl32e => 25 * position,
            Self::Vlp16 => ((position / 16) * 55_296 + (position % 16) * 2_304) * 1000 / 110_592,
        }
    }
}
