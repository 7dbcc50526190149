//! What stands in the packets of each lidar profile (Ouster's sensor documentation, "lidar data packet format").

/// A lidar profile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Profile {
    /// Before firmware 2.2, and on demand after.
    Legacy,
    /// One return of 1 mm a count, with signal and ambient light.
    Rng19Rfl8Sig16Nir16,
    /// Two returns of 1 mm a count.
    Rng19Rfl8Sig16Nir16Dual,
    /// One return of 8 mm a count.
    Rng15Rfl8Nir8,
    /// Two returns of 8 mm a count.
    Rng15Rfl8Nir8Dual,
    /// Two returns of 8 mm a count, with functional safety.
    FusaRng15Rfl8Nir8Dual,
    /// Two returns of 1 mm a count, for the maker's own use.
    FiveWordPixel,
    /// One return of 8 mm a count, and the window.
    Rng15Rfl8Win8,
    /// One return of 8 mm a count, and zones.
    Rng15Rfl8Nir8Zone16,
    /// One return of 1 mm a count, and zones.
    Rng19Rfl8Sig16Nir16Zone16,
    /// Two returns of 1 mm a count, and zones.
    Rng19Rfl8Sig16Zone16Dual,
}

/// Where a return stands among the bytes of a pixel.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub range: usize,
    pub reflectivity: usize,
}

impl Profile {
    /// Every profile.
    pub const ALL: [Self; 11] = [
        Self::Legacy,
        Self::Rng19Rfl8Sig16Nir16,
        Self::Rng19Rfl8Sig16Nir16Dual,
        Self::Rng15Rfl8Nir8,
        Self::Rng15Rfl8Nir8Dual,
        Self::FusaRng15Rfl8Nir8Dual,
        Self::FiveWordPixel,
        Self::Rng15Rfl8Win8,
        Self::Rng15Rfl8Nir8Zone16,
        Self::Rng19Rfl8Sig16Nir16Zone16,
        Self::Rng19Rfl8Sig16Zone16Dual,
    ];

    /// Name, as the sensor's metadata have it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Legacy => "LEGACY",
            Self::Rng19Rfl8Sig16Nir16 => "RNG19_RFL8_SIG16_NIR16",
            Self::Rng19Rfl8Sig16Nir16Dual => "RNG19_RFL8_SIG16_NIR16_DUAL",
            Self::Rng15Rfl8Nir8 => "RNG15_RFL8_NIR8",
            Self::Rng15Rfl8Nir8Dual => "RNG15_RFL8_NIR8_DUAL",
            Self::FusaRng15Rfl8Nir8Dual => "FUSA_RNG15_RFL8_NIR8_DUAL",
            Self::FiveWordPixel => "FIVE_WORD_PIXEL",
            Self::Rng15Rfl8Win8 => "RNG15_RFL8_WIN8",
            Self::Rng15Rfl8Nir8Zone16 => "RNG15_RFL8_NIR8_ZONE16",
            Self::Rng19Rfl8Sig16Nir16Zone16 => "RNG19_RFL8_SIG16_NIR16_ZONE16",
            Self::Rng19Rfl8Sig16Zone16Dual => "RNG19_RFL8_SIG16_ZONE16_DUAL",
        }
    }

    /// Bytes before the columns, and behind them.
    pub(super) const fn packet_header(self) -> usize {
        if matches!(self, Self::Legacy) { 0 } else { 32 }
    }

    /// Bytes of a column before its pixels.
    pub(super) const fn column_header(self) -> usize {
        if matches!(self, Self::Legacy) { 16 } else { 12 }
    }

    /// Bytes of a column behind its pixels.
    pub(super) const fn column_footer(self) -> usize {
        if matches!(self, Self::Legacy) { 4 } else { 0 }
    }

    /// Bytes of a pixel.
    pub(super) const fn pixel(self) -> usize {
        match self {
            Self::Rng15Rfl8Nir8 | Self::Rng15Rfl8Win8 => 4,
            Self::Rng15Rfl8Nir8Dual | Self::FusaRng15Rfl8Nir8Dual | Self::Rng15Rfl8Nir8Zone16 => 8,
            Self::Legacy | Self::Rng19Rfl8Sig16Nir16 | Self::Rng19Rfl8Sig16Nir16Zone16 => 12,
            Self::Rng19Rfl8Sig16Nir16Dual | Self::Rng19Rfl8Sig16Zone16Dual => 16,
            Self::FiveWordPixel => 20,
        }
    }

    /// Bits of a range in the 32 that begin with it, and the length of a count, mm.
    pub(super) const fn range(self) -> (u32, u32) {
        match self {
            Self::Legacy => (0x000F_FFFF, 1),
            Self::Rng15Rfl8Nir8
            | Self::Rng15Rfl8Nir8Dual
            | Self::FusaRng15Rfl8Nir8Dual
            | Self::Rng15Rfl8Win8
            | Self::Rng15Rfl8Nir8Zone16 => (0x7FFF, 8),
            Self::Rng19Rfl8Sig16Nir16
            | Self::Rng19Rfl8Sig16Nir16Dual
            | Self::FiveWordPixel
            | Self::Rng19Rfl8Sig16Nir16Zone16
            | Self::Rng19Rfl8Sig16Zone16Dual => (0x0007_FFFF, 1),
        }
    }

    /// Where the returns of a pixel stand: the strongest, and the second strongest if there are two.
    pub(super) const fn places(self) -> (Place, Option<Place>) {
        match self {
            Self::Legacy | Self::Rng19Rfl8Sig16Nir16 | Self::Rng19Rfl8Sig16Nir16Zone16 => {
                (Place { range: 0, reflectivity: 4 }, None)
            }
            Self::Rng15Rfl8Nir8 | Self::Rng15Rfl8Win8 | Self::Rng15Rfl8Nir8Zone16 => {
                (Place { range: 0, reflectivity: 2 }, None)
            }
            Self::Rng15Rfl8Nir8Dual | Self::FusaRng15Rfl8Nir8Dual => {
                (Place { range: 0, reflectivity: 2 }, Some(Place { range: 4, reflectivity: 6 }))
            }
            Self::Rng19Rfl8Sig16Nir16Dual | Self::FiveWordPixel | Self::Rng19Rfl8Sig16Zone16Dual => {
                (Place { range: 0, reflectivity: 3 }, Some(Place { range: 4, reflectivity: 7 }))
            }
        }
    }
}
