//! The sensors that send these packets.

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
