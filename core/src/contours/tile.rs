//! The squares of a kept map.

/// Side of a tile, m.
pub const TILE: f64 = 4.0;

/// A square of a map, and which of the points are in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tile {
    /// Row and column: the corner of a tile is at `TILE` times these, y and x.
    pub place: (i16, i16),
    /// Number of the point behind its last one. Its first one is the one behind those of the tile before.
    pub end: u32,
}

impl Tile {
    /// Bytes of a tile.
    pub const BYTES: usize = 8;

    /// The tile in which a position lies. None beyond 131 km.
    #[must_use]
    pub fn place_of(x: f64, y: f64) -> Option<(i16, i16)> {
        let index = |length: f64| {
            let index = libm::floor(length / TILE);
            (libm::fabs(index) < f64::from(i16::MAX)).then_some(index as i16)
        };
        Some((index(y)?, index(x)?))
    }

    /// The tile that a map has in these bytes.
    #[must_use]
    pub const fn of_bytes([a, b, c, d, e, f, g, h]: [u8; Self::BYTES]) -> Self {
        let place = (i16::from_le_bytes([a, b]), i16::from_le_bytes([c, d]));
        Self { place, end: u32::from_le_bytes([e, f, g, h]) }
    }

    /// What a map has of it: row, column and end, little endian.
    #[must_use]
    pub const fn bytes(&self) -> [u8; Self::BYTES] {
        let ([a, b], [c, d]) = (self.place.0.to_le_bytes(), self.place.1.to_le_bytes());
        let [e, f, g, h] = self.end.to_le_bytes();
        [a, b, c, d, e, f, g, h]
    }
}
