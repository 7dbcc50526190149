//! A point of a kept map.

use super::SurfacePoint;
use crate::geometry::ScanPoint;

/// Counts of a coordinate for a metre: 4 m in 12 bits.
const COUNTS: f32 = 1023.0;

/// Most counts of a coordinate.
const MOST: f32 = 4095.0;

/// Counts for the length of a normal.
const UNIT: f32 = 127.0;

/// A point in 5 bytes: twice 12 bits for the position in its tile, to a millimetre, and a normal to half a degree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct KeptPoint {
    bytes: [u8; Self::BYTES],
}

impl KeptPoint {
    /// Bytes of a point.
    pub const BYTES: usize = 5;

    /// Packs a point, given from the corner of its tile.
    #[must_use]
    pub fn of(point: &SurfacePoint) -> Self {
        let count = Self::column_of;
        let normal = |share: f32| (libm::roundf(share * UNIT) as i8).to_le_bytes()[0];
        let (x, y) = (count(point.position.x), count(point.position.y));
        let high = ((x >> 8) | ((y >> 8) << 4)) as u8;
        Self { bytes: [x.to_le_bytes()[0], y.to_le_bytes()[0], high, normal(point.normal.x), normal(point.normal.y)] }
    }

    /// The point that a map has in these bytes.
    #[must_use]
    pub const fn of_bytes(bytes: [u8; Self::BYTES]) -> Self {
        Self { bytes }
    }

    /// What a map has of it.
    #[must_use]
    pub const fn bytes(&self) -> [u8; Self::BYTES] {
        self.bytes
    }

    /// Counts from the corner of its tile along the first axis: points of a tile are in order of them.
    #[must_use]
    pub const fn column(&self) -> u16 {
        let [x, _, high, ..] = self.bytes;
        u16::from_le_bytes([x, high & 15])
    }

    /// The column in which a coordinate from the corner of a tile lies, m; the nearest one of a coordinate beside the tile.
    pub(super) fn column_of(length: f32) -> u16 {
        libm::roundf(length * COUNTS).clamp(0.0, MOST) as u16
    }

    /// The point from the corner of its tile.
    #[must_use]
    pub fn unpacked(&self) -> SurfacePoint {
        let [x, y, high, normal_x, normal_y] = self.bytes;
        let length = |low: u8, high: u8| f32::from(u16::from_le_bytes([low, high])) * (1.0 / COUNTS);
        let share = |byte: u8| f32::from(i8::from_le_bytes([byte])) * (1.0 / UNIT);
        SurfacePoint {
            position: ScanPoint::new(length(x, high & 15), length(y, high >> 4)),
            normal: ScanPoint::new(share(normal_x), share(normal_y)),
        }
    }
}
