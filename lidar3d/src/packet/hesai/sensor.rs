//! The sensors, and when each of their lasers fires.

use crate::packet::Filter;

/// Firing times of the channels of a Pandar40P (manual, appendix), ns before the end of the block.
const PANDAR40P: [i32; 40] = [
    42_220, 28_470, 16_040, 3_620, 45_490, 31_740, 47_460, 54_670, 20_620, 33_710, 40_910, 8_190, 20_620, 27_160,
    50_730, 8_190, 14_740, 36_980, 45_490, 52_700, 23_890, 31_740, 38_950, 11_470, 18_650, 25_190, 48_760, 6_230,
    12_770, 35_010, 21_920, 9_500, 43_520, 29_770, 17_350, 4_920, 42_220, 28_470, 16_040, 3_620,
];
/// Firing times of the channels of a PandarQT64 (manual, appendix), ns after the beginning of the block.
const PANDAR_QT64: [i32; 64] = [
    12_310, 14_370, 16_430, 18_490, 20_540, 22_600, 24_660, 26_710, 29_160, 31_220, 33_280, 35_340, 37_390, 39_450,
    41_500, 43_560, 46_610, 48_670, 50_730, 52_780, 54_840, 56_900, 58_950, 61_010, 63_450, 65_520, 67_580, 69_630,
    71_690, 73_740, 75_800, 77_860, 80_900, 82_970, 85_020, 87_080, 89_140, 91_190, 93_250, 95_300, 97_750, 99_820,
    101_870, 103_930, 105_980, 108_040, 110_100, 112_150, 115_200, 117_260, 119_320, 121_380, 123_430, 125_490,
    127_540, 129_600, 132_050, 134_110, 136_170, 138_220, 140_280, 142_340, 144_390, 146_450,
];

/// A kind of sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sensor {
    /// Pandar40P: 40 lasers.
    Pandar40p,
    /// PandarQT64: 64 lasers, to the near.
    PandarQt64,
    /// PandarXT (XT32): 32 lasers.
    PandarXt32,
}

/// Where things stand in a packet.
#[derive(Clone, Copy)]
pub(super) struct Layout {
    /// Bytes before the blocks.
    pub header: usize,
    pub blocks: usize,
    /// Bytes of a block before its returns: those that begin it, and two of the angle.
    pub block_header: usize,
    /// Bytes of a return.
    pub unit: usize,
    /// Bytes behind the blocks, without a number of the packet, of which there may be four more.
    pub tail: usize,
    /// In the tail.
    pub return_mode: usize,
    /// In the tail: microseconds.
    pub micros: usize,
    /// In the tail: year, month, day, hour, minute, second.
    pub date: usize,
}

impl Sensor {
    /// Every kind.
    pub const ALL: [Self; 3] = [Self::Pandar40p, Self::PandarQt64, Self::PandarXt32];

    /// Name, as the maker writes it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pandar40p => "Pandar40P",
            Self::PandarQt64 => "PandarQT64",
            Self::PandarXt32 => "PandarXT32",
        }
    }

    /// Number of lasers.
    #[must_use]
    pub const fn lasers(self) -> usize {
        match self {
            Self::Pandar40p => 40,
            Self::PandarQt64 => 64,
            Self::PandarXt32 => 32,
        }
    }

    /// Distances that are believed if nobody says otherwise, m (data sheets).
    #[must_use]
    pub const fn filter(self) -> Filter {
        match self {
            Self::Pandar40p => Filter { near: 0.3, far: 230.0 },
            Self::PandarQt64 => Filter { near: 0.1, far: 65.0 },
            Self::PandarXt32 => Filter { near: 0.05, far: 130.0 },
        }
    }

    pub(super) const fn layout(self) -> Layout {
        let layout =
            Layout { header: 12, blocks: 4, block_header: 2, unit: 4, tail: 24, return_mode: 16, micros: 12, date: 18 };
        match self {
            Self::Pandar40p => Layout {
                header: 0,
                blocks: 10,
                block_header: 4,
                unit: 3,
                tail: 22,
                return_mode: 14,
                micros: 10,
                date: 16,
            },
            Self::PandarQt64 => layout,
            Self::PandarXt32 => Layout { blocks: 8, return_mode: 10, micros: 19, date: 13, ..layout },
        }
    }

    /// When a return is measured after the time that its packet states, ns (manuals, "absolute time of point cloud
    /// data"). `returns` are those of each firing.
    pub(super) fn time(self, block: usize, laser: usize, returns: usize) -> i32 {
        let (from_first, from_last) =
            ((block / returns) as i32, ((self.layout().blocks - 1).saturating_sub(block) / returns) as i32);
        match self {
            Self::Pandar40p => -28_580 - 55_560 * from_last - PANDAR40P.get(laser).copied().unwrap_or(0),
            Self::PandarQt64 => 25_710 + 500_000 * from_first / 3 + PANDAR_QT64.get(laser).copied().unwrap_or(0),
            Self::PandarXt32 => 5_632 - 50_000 * from_last + 368 + 1_512 * laser as i32,
        }
    }
}
