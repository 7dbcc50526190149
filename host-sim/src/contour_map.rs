//! Maps of contours in tiles, in the bytes in which the vehicle keeps them.

use std::collections::BTreeMap;

use agv_core::contours::{KeptMap, KeptMapError, KeptPoint, SurfacePoint, TILE, Tile};
use agv_core::geometry::Point;

/// A point of a map in W, m, and the unit normal of its surface; a corner has none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapPoint {
    /// Position.
    pub position: Point,
    /// Normal, or zero.
    pub normal: Point,
}

/// A map in tiles, in the bytes in which the vehicle keeps it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ContourMap {
    bytes: Vec<u8>,
}

impl ContourMap {
    /// Puts points into tiles. Those beyond 131 km are left out.
    #[must_use]
    pub fn of(points: impl IntoIterator<Item = MapPoint>) -> Self {
        let mut by_tile: BTreeMap<(i16, i16), Vec<KeptPoint>> = BTreeMap::new();
        for MapPoint { position, normal } in points {
            let Some(place) = Tile::place_of(position.x, position.y) else { continue };
            let corner = Point::new(f64::from(place.1), f64::from(place.0)) * TILE;
            let point = SurfacePoint { position: (position - corner).cast(), normal: normal.cast() };
            by_tile.entry(place).or_default().push(KeptPoint::of(&point));
        }
        by_tile.values_mut().for_each(|points| points.sort_by_key(KeptPoint::column));
        let mut bytes = KeptMap::header(by_tile.len() as u32).to_vec();
        let mut end = 0;
        for (place, points) in &by_tile {
            end += points.len() as u32;
            bytes.extend(Tile { place: *place, end }.bytes());
        }
        bytes.extend(by_tile.values().flatten().flat_map(KeptPoint::bytes));
        Self { bytes }
    }

    /// Takes bytes of a vehicle.
    ///
    /// # Errors
    /// See [`KeptMapError`].
    pub fn of_bytes(bytes: Vec<u8>) -> Result<Self, KeptMapError> {
        KeptMap::read(&bytes)?;
        Ok(Self { bytes })
    }

    /// The map as the core uses it.
    #[must_use]
    pub fn view(&self) -> KeptMap<'_> {
        KeptMap::read(&self.bytes).unwrap_or(KeptMap::EMPTY)
    }

    /// Number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.view().len()
    }

    /// Whether it holds nothing.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.view().is_empty()
    }

    /// What the vehicle keeps.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Its points in W.
    pub fn points(&self) -> impl Iterator<Item = MapPoint> {
        self.view().surfaces().map(|(corner, point)| MapPoint {
            position: corner + point.position.cast::<f64>(),
            normal: point.normal.cast(),
        })
    }
}

impl Default for ContourMap {
    fn default() -> Self {
        Self::of([])
    }
}
