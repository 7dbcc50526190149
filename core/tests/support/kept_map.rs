//! Kept maps of contours of known walls.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::collections::BTreeMap;

use agv_core::contours::{KeptMap, KeptPoint, SurfacePoint, TILE, Tile};
use agv_core::geometry::{Point, Pose};

use super::walls::{Walls, surfaces};

/// A map of walls, moved by a pose, with a point each 10 cm. It stays in memory as long as the test runs.
pub fn kept_map(walls: &Walls, moved: &Pose) -> KeptMap<'static> {
    let mut by_tile: BTreeMap<(i16, i16), Vec<KeptPoint>> = BTreeMap::new();
    for (position, normal) in surfaces(walls, 0.1) {
        let (position, normal) = (moved.transform(&position), moved.transform(&normal) - moved.position());
        let place = Tile::place_of(position.x, position.y).unwrap();
        let corner = Point::new(f64::from(place.1), f64::from(place.0)) * TILE;
        let point = SurfacePoint { position: (position - corner).cast(), normal: normal.cast() };
        by_tile.entry(place).or_default().push(KeptPoint::of(&point));
    }
    let (mut bytes, mut points) = (KeptMap::header(by_tile.len() as u32).to_vec(), Vec::new());
    for (place, mut found) in by_tile {
        found.sort_by_key(KeptPoint::column);
        points.extend(found);
        bytes.extend(Tile { place, end: points.len() as u32 }.bytes());
    }
    bytes.extend(points.iter().flat_map(KeptPoint::bytes));
    KeptMap::read(bytes.leak()).unwrap()
}
