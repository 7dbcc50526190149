//! The sensors that send these packets.

use super::{BLOCKS, Filter, Packet, RETURNS, ReturnMode, counts_between};

const HDL32E_ELEVATIONS: [f64; 32] = [
    -30.67, -9.33, -29.33, -8.0, -28.0, -6.67, -26.67, -5.33, -25.33, -4.0, -24.0, -2.67, -22.67, -1.33, -21.33, 0.0,
    -20.0, 1.33, -18.67, 2.67, -17.33, 4.0, -16.0, 5.33, -14.67, 6.67, -13.33, 8.0, -12.0, 9.33, -10.67, 10.67,
];
const VLP16_ELEVATIONS: [f64; 16] =
    [-15.0, 1.0, -13.0, 3.0, -11.0, 5.0, -9.0, 7.0, -7.0, 9.0, -5.0, 11.0, -3.0, 13.0, -1.0, 15.0];
const VLP32C_ELEVATIONS: [f64; 32] = [
    -25.0, -1.0, -1.667, -15.639, -11.31, 0.0, -0.667, -8.843, -7.254, 0.333, -0.333, -6.148, -5.333, 1.333, 0.667,
    -4.0, -4.667, 1.667, 1.0, -3.667, -3.333, 3.333, 2.333, -2.667, -3.0, 7.0, 4.667, -2.333, -2.0, 15.0, 10.333,
    -1.333,
];
const VLP32C_ROTATIONS: [f64; 32] = [
    -1.4, 4.2, -1.4, 1.4, -1.4, 1.4, -4.2, 1.4, -1.4, 4.2, -1.4, 1.4, -4.2, 1.4, -4.2, 1.4, -1.4, 4.2, -1.4, 4.2, -4.2,
    1.4, -1.4, 1.4, -1.4, 1.4, -1.4, 4.2, -4.2, 1.4, -1.4, 1.4,
];
#[expect(clippy::approx_constant, reason = "6.28 is an angle in degrees")]
const VLS128_ELEVATIONS: [f64; 128] = [
    -11.742, -1.99, 3.4, -5.29, -0.78, 4.61, -4.08, 1.31, -6.5, -1.11, 4.28, -4.41, 0.1, 6.48, -3.2, 2.19, -3.86, 1.53,
    -9.244, -1.77, 2.74, -5.95, -0.56, 4.83, -2.98, 2.41, -6.28, -0.89, 3.62, -5.07, 0.32, 7.58, -0.34, 5.18, -3.64,
    1.75, -25.0, -2.43, 2.96, -5.73, 0.54, 9.7, -2.76, 2.63, -7.65, -1.55, 3.84, -4.85, 3.18, -5.51, -0.12, 5.73, -4.3,
    1.09, -16.042, -2.21, 4.06, -4.63, 0.76, 15.0, -3.42, 1.97, -6.85, -1.33, -5.62, -0.23, 5.43, -3.53, 0.98, -19.582,
    -2.32, 3.07, -4.74, 0.65, 11.75, -2.65, 1.86, -7.15, -1.44, 3.95, -2.1, 3.29, -5.4, -0.01, 4.5, -4.19, 1.2,
    -13.565, -1.22, 4.17, -4.52, 0.87, 6.08, -3.31, 2.08, -6.65, 1.42, -10.346, -1.88, 3.51, -6.06, -0.67, 4.72, -3.97,
    2.3, -6.39, -1.0, 4.39, -5.18, 0.21, 6.98, -3.09, 4.98, -3.75, 1.64, -8.352, -2.54, 2.85, -5.84, -0.45, 8.43,
    -2.87, 2.52, -6.17, -1.66, 3.73, -4.96, 0.43,
];
/// Of each group of eight lasers of a VLS-128.
const VLS128_ROTATIONS: [f64; 8] = [-6.354, -4.548, -2.732, -0.911, 0.911, 2.732, 4.548, 6.354];

/// Shares of 7.2 us after the first of four lasers of an HDL-64E (S3 manual, laser firing table), ns.
const HDL64E_FOUR: [u32; 4] = [0, 1_300, 2_500, 3_700];

/// A kind of sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sensor {
    /// HDL-64E, S1, S2 and S3: two groups of 32 lasers, one block each.
    Hdl64e,
    /// HDL-32E: one firing of 32 lasers a block.
    Hdl32e,
    /// VLP-16: two firings of 16 lasers a block.
    Vlp16,
    /// VLP-32C: one firing of 32 lasers a block.
    Vlp32c,
    /// VLS-128 (Alpha Prime): four groups of 32 lasers, one block each.
    Vls128,
}

/// Packets of one sensor are given to the decoder of another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "std", derive(thiserror::Error))]
#[cfg_attr(feature = "std", error("the packets are of a {}, not of a {}", found.name(), wanted.name()))]
pub struct OtherSensor {
    /// What was asked for.
    pub wanted: Sensor,
    /// What the packets state.
    pub found: Sensor,
}

impl Sensor {
    /// Every kind.
    pub const ALL: [Self; 5] = [Self::Hdl64e, Self::Hdl32e, Self::Vlp16, Self::Vlp32c, Self::Vls128];

    /// Name, as the maker writes it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hdl64e => "HDL-64E",
            Self::Hdl32e => "HDL-32E",
            Self::Vlp16 => "VLP-16",
            Self::Vlp32c => "VLP-32C",
            Self::Vls128 => "VLS-128",
        }
    }

    /// The sensor that sends such packets: only a VLS-128 has four banks of lasers and only an HDL-64E two; the others
    /// state what they are in the last byte. None for a packet of upper blocks alone that states nothing.
    #[must_use]
    pub fn of_packet(packet: &Packet<'_>) -> Option<Self> {
        let tail = packet.tail();
        let bank = packet.blocks().map(|block| block.bank()).max().unwrap_or(0);
        match (tail.return_mode(), tail.status().1) {
            _ if bank > 1 => Some(Self::Vls128),
            _ if bank > 0 => Some(Self::Hdl64e),
            (Some(_), 0x21) => Some(Self::Hdl32e),
            (Some(_), 0x22) => Some(Self::Vlp16),
            (Some(_), 0x28) => Some(Self::Vlp32c),
            _ => None,
        }
    }

    /// Refuses packets of another sensor; packets that state nothing may be of any.
    ///
    /// # Errors
    /// [`OtherSensor`].
    pub fn accept(self, packet: &Packet<'_>) -> Result<(), OtherSensor> {
        match Self::of_packet(packet).filter(|found| *found != self) {
            Some(found) => Err(OtherSensor { wanted: self, found }),
            None => Ok(()),
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
            Self::Vlp32c => Some(&VLP32C_ELEVATIONS),
            Self::Vls128 => Some(&VLS128_ELEVATIONS),
        }
    }

    /// Rotation of a laser in the head where all sensors of the kind have the same, clockwise, deg (manuals).
    #[must_use]
    pub fn rotation(self, laser: usize) -> f64 {
        match self {
            Self::Vlp32c => VLP32C_ROTATIONS.get(laser).copied().unwrap_or(0.0),
            Self::Vls128 => VLS128_ROTATIONS.get(laser % VLS128_ROTATIONS.len()).copied().unwrap_or(0.0),
            Self::Hdl64e | Self::Hdl32e | Self::Vlp16 => 0.0,
        }
    }

    /// How far before the axis the point lies in which all beams meet, m: the height of a beam at the axis is this by the
    /// tangent of its elevation below the sensor's plane. From the maker's drawings of the VLP-16 (86-0101) and the
    /// HDL-32E (86-0106); those of VLP-32C and VLS-128 as velodyne_decoder states them. `velodyne_pointcloud` and nebula
    /// leave these up to 27 mm out; their calibration files state offsets of 0. None for an HDL-64E.
    #[must_use]
    pub const fn focal_point(self) -> Option<f64> {
        match self {
            Self::Hdl64e => None,
            Self::Hdl32e => Some(0.028_83),
            Self::Vlp16 => Some(0.041_91),
            Self::Vlp32c => Some(0.042_4),
            Self::Vls128 => Some(0.058_63),
        }
    }

    /// Number of lasers.
    #[must_use]
    pub const fn lasers(self) -> usize {
        match self {
            Self::Vls128 => 128,
            Self::Hdl64e => 64,
            Self::Hdl32e | Self::Vlp32c => 32,
            Self::Vlp16 => 16,
        }
    }

    /// Length of one count of distance, m (manuals).
    #[must_use]
    pub const fn distance_resolution(self) -> f64 {
        match self {
            Self::Hdl64e | Self::Hdl32e | Self::Vlp16 => 0.002,
            Self::Vlp32c | Self::Vls128 => 0.004,
        }
    }

    /// Distances that are believed if nobody says otherwise: for an HDL-64E those of M 2.3.2; the others send nothing
    /// from nearer than they can see, so only what lies within their own housing is refused.
    #[must_use]
    pub const fn filter(self) -> Filter {
        match self {
            Self::Hdl64e => Filter { near: 0.9, far: 120.0 },
            Self::Hdl32e | Self::Vlp16 | Self::Vlp32c | Self::Vls128 => Filter { near: 0.1, far: 300.0 },
        }
    }

    /// Number of the laser whose return stands at a place of a block of a bank.
    pub(super) const fn laser(self, bank: usize, place: usize) -> usize {
        match self {
            Self::Hdl64e | Self::Vls128 => RETURNS * bank + place,
            Self::Hdl32e | Self::Vlp32c => place,
            Self::Vlp16 => place % 16,
        }
    }

    /// Blocks that state the same angle: of one firing of all lasers. A VLP-16 states that of two firings.
    pub(super) const fn blocks(self) -> usize {
        match self {
            Self::Hdl64e => 2,
            Self::Hdl32e | Self::Vlp16 | Self::Vlp32c => 1,
            Self::Vls128 => 4,
        }
    }

    /// Returns of each firing in a packet. An HDL-64E does not state its mode: with two returns, its first four blocks
    /// have one angle.
    pub(super) fn returns(self, packet: &Packet<'_>) -> usize {
        let is_dual = match self {
            Self::Hdl64e => packet.azimuth(0) == packet.azimuth(2) && packet.azimuth(0) != packet.azimuth(4),
            _ => packet.tail().return_mode() == Some(ReturnMode::Dual),
        };
        if is_dual { 2 } else { 1 }
    }

    /// By how many hundredths of a degree the head turns in how many firings, over a whole packet, and at a VLS-128, whose
    /// packets hold three firings or one, since the packet before; (0, 1) if nothing tells. A sensor that is blind on one
    /// side leaves out the firings there: such leaps do not count.
    pub(super) fn step(self, packet: &Packet<'_>, before: Option<u16>) -> (u32, u32) {
        let stride = self.blocks() * self.returns(packet);
        let mut steps = [0_u16; BLOCKS];
        let mut count = 0;
        let mut last = None;
        for block in (0..BLOCKS).step_by(stride) {
            let Some(azimuth) = packet.azimuth(block) else { break };
            if let (Some(last), Some(step)) = (last, steps.get_mut(count)) {
                *step = counts_between(last, azimuth);
                count += 1;
            }
            last = Some(azimuth);
        }
        if let (Self::Vls128, Some(before), Some(azimuth)) = (self, before, packet.azimuth(0)) {
            let (step, firings) = (u32::from(counts_between(before, azimuth)), count as u32 + 1);
            if step < LEAP * firings {
                return (step, firings);
            }
        }
        let Some(found) = steps.get_mut(..count) else { return (0, 1) };
        found.sort_unstable();
        let middle = found.get(count / 2).copied().unwrap_or(0);
        let regular = found.iter().filter(|step| u32::from(**step) <= 2 * u32::from(middle) + 2);
        let (sum, number) = regular.fold((0, 0), |(sum, number), step| (sum + u32::from(*step), number + 1));
        (sum, number.max(1))
    }

    /// Time from one angle that is stated to the next one, ns.
    pub(super) const fn period(self) -> u32 {
        match self {
            Self::Hdl64e => 57_600,
            Self::Hdl32e => 46_080,
            Self::Vlp16 => 2 * 55_296,
            Self::Vlp32c => 55_296,
            Self::Vls128 => 53_300,
        }
    }

    /// How long after the angle that its block states a return is measured, ns. From the firing tables of the manuals:
    /// HDL-64E S3 groups of four lasers every 7.2 us, of which an S2 needs 6 us, which is the same share of a firing
    /// within 0.012; HDL-32E 1.152 us a laser; VLP-16 2.304 us a laser and 55.296 us a firing; VLP-32C 2.304 us a pair of
    /// lasers; VLS-128 2.665 us a group of eight, and one more pause of that length after eight groups.
    pub(super) fn firing_time(self, bank: usize, place: usize) -> u32 {
        let position = place as u32;
        match self {
            Self::Hdl64e => 7_200 * (position / 4) + HDL64E_FOUR.get(place % 4).copied().unwrap_or(0),
            Self::Hdl32e => 1_152 * position,
            Self::Vlp16 => (position / 16) * 55_296 + (position % 16) * 2_304,
            Self::Vlp32c => (position / 2) * 2_304,
            Self::Vls128 => {
                let group = (RETURNS * bank + place) as u32 / 8;
                2_665 * (group + group / 8)
            }
        }
    }

    /// Time of the first firing of a packet after the time that the packet states, ns (VLS-128 manual: the time is that
    /// of the fourth group).
    pub(super) const fn first_firing(self) -> i32 {
        match self {
            Self::Vls128 => -8_700,
            Self::Hdl64e | Self::Hdl32e | Self::Vlp16 | Self::Vlp32c => 0,
        }
    }
}

/// A turn that is more than one of a firing at the highest speed, 0.01 degrees.
const LEAP: u32 = 60;
