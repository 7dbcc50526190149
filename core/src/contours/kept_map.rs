//! A map of contours that is kept: points of surfaces in square tiles, of which those around the vehicle are loaded.

use super::{KeyRing, LARGEST_REACH, Submap, SurfacePoint};
use crate::geometry::{Pose, ScanPoint};

/// Side of a tile, m.
pub const TILE: f64 = 4.0;

/// Tiles to each side that are loaded: they reach as far as a submap does.
const AROUND: i32 = 4;

/// Counts of a coordinate for a metre: 4 m in 12 bits.
const COUNTS: f32 = 1023.0;

/// Counts for the length of a normal.
const UNIT: f32 = 127.0;

/// A point in 5 bytes: twice 12 bits for the position in its tile, to a millimetre, and a normal to half a degree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct KeptPoint {
    bytes: [u8; 5],
}

impl KeptPoint {
    /// Packs a point, given from the corner of its tile.
    #[must_use]
    pub fn of(point: &SurfacePoint) -> Self {
        let count = |length: f32| libm::roundf(length * COUNTS).clamp(0.0, 4095.0) as u16;
        let normal = |share: f32| (libm::roundf(share * UNIT) as i8).to_le_bytes()[0];
        let (x, y) = (count(point.position.x), count(point.position.y));
        let high = ((x >> 8) | ((y >> 8) << 4)) as u8;
        Self { bytes: [x.to_le_bytes()[0], y.to_le_bytes()[0], high, normal(point.normal.x), normal(point.normal.y)] }
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

/// A square of a map, and which of the points are in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tile {
    /// Row and column: the corner of a tile is at `TILE` times these, y and x.
    pub place: (i16, i16),
    /// Number of its first point.
    pub first: u32,
    /// Number of its points.
    pub count: u16,
}

impl Tile {
    /// The tile in which a position lies. None beyond 131 km.
    #[must_use]
    pub fn place_of(x: f64, y: f64) -> Option<(i16, i16)> {
        let index = |length: f64| {
            let index = libm::floor(length / TILE);
            (libm::fabs(index) < f64::from(i16::MAX)).then_some(index as i16)
        };
        Some((index(y)?, index(x)?))
    }
}

/// Why a map cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KeptMapError {
    /// Tiles are not in order of their rows and columns, each once.
    Order,
    /// A tile names points that are not there.
    Points,
}

/// A map in memory that somebody else holds.
#[derive(Clone, Copy, Debug)]
pub struct KeptMap<'a> {
    tiles: &'a [Tile],
    points: &'a [KeptPoint],
}

impl<'a> KeptMap<'a> {
    /// Tiles in order of their places, and their points.
    ///
    /// # Errors
    /// See [`KeptMapError`].
    pub fn new(tiles: &'a [Tile], points: &'a [KeptPoint]) -> Result<Self, KeptMapError> {
        if !tiles.is_sorted_by(|before, after| before.place < after.place) {
            return Err(KeptMapError::Order);
        }
        let ends = |tile: &Tile| (tile.first as usize).checked_add(usize::from(tile.count));
        if tiles.iter().all(|tile| ends(tile).is_some_and(|end| end <= points.len())) {
            Ok(Self { tiles, points })
        } else {
            Err(KeptMapError::Points)
        }
    }

    /// Fills a submap with what is around a place, from near to far. The submap says whether there was room for all.
    pub fn load<const ROOM: usize>(&self, place: (i16, i16), submap: &mut Submap<ROOM>) {
        submap.begin(&middle(place));
        for number in 0..TILES_AROUND {
            let _ = self.load_part(place, number, (0, usize::MAX), submap);
        }
    }

    /// Adds some points of one of the tiles around a place, of which the nearest one has number 0, to a submap that was begun in
    /// the middle of that place: `count` of them from `first` on. How many were added.
    fn load_part<const ROOM: usize>(
        &self,
        place: (i16, i16),
        number: usize,
        (first, count): (usize, usize),
        submap: &mut Submap<ROOM>,
    ) -> usize {
        let (down, right) = beside(number as i32);
        let Some(tile) = self.tile_beside(place, (down, right)) else { return 0 };
        let shift = corner_of(down, right);
        let points = self.points_of(tile).iter().skip(first).take(count);
        let added = points.len();
        for point in points {
            let point = point.unpacked();
            submap.add_point(&SurfacePoint { position: point.position + shift, ..point });
        }
        added
    }

    /// Goes through the points within `reach` (m) of a position along each axis; both are in the frame in the middle of a tile. How
    /// many points were looked at.
    pub(super) fn for_each_near(
        &self,
        place: (i16, i16),
        position: &ScanPoint,
        reach: f32,
        mut with: impl FnMut(SurfacePoint),
    ) -> u32 {
        let steps = |length: f32| libm::floorf(length * (1.0 / TILE as f32) + 0.5) as i32;
        let mut looked_at: u32 = 0;
        for down in steps(position.y - reach)..=steps(position.y + reach) {
            for right in steps(position.x - reach)..=steps(position.x + reach) {
                let Some(tile) = self.tile_beside(place, (down, right)) else { continue };
                let shift = corner_of(down, right);
                for point in self.points_of(tile) {
                    let point = point.unpacked();
                    let position_of_it = point.position + shift;
                    if (position_of_it - position).amax() <= reach {
                        with(SurfacePoint { position: position_of_it, ..point });
                    }
                }
                looked_at = looked_at.saturating_add(u32::from(tile.count));
            }
        }
        looked_at
    }

    /// The tile so many rows and columns from a place.
    fn tile_beside(&self, place: (i16, i16), (down, right): (i32, i32)) -> Option<&'a Tile> {
        let row = i16::try_from(i32::from(place.0).checked_add(down)?).ok()?;
        let column = i16::try_from(i32::from(place.1).checked_add(right)?).ok()?;
        let found = self.tiles.binary_search_by(|tile| tile.place.cmp(&(row, column))).ok()?;
        self.tiles.get(found)
    }

    /// All tiles, in order of their places.
    pub(super) const fn tiles(&self) -> &'a [Tile] {
        self.tiles
    }

    /// The points of a tile.
    pub(super) fn points_of(&self, tile: &Tile) -> &'a [KeptPoint] {
        let first = tile.first as usize;
        self.points.get(first..first + usize::from(tile.count)).unwrap_or_default()
    }
}

/// The corner of a tile so many rows and columns away, from the middle of the tile here.
fn corner_of(down: i32, right: i32) -> ScanPoint {
    let corner = |steps: i32| (f64::from(steps) - 0.5) as f32 * TILE as f32;
    ScanPoint::new(corner(right), corner(down))
}

/// The tiles around a place by number, ring by ring: rows and columns away.
fn beside(number: i32) -> (i32, i32) {
    let mut ring = 0;
    // Rings 0 to `ring` have the square of 2 ring + 1 tiles.
    while ring < AROUND && number >= (2 * ring + 1) * (2 * ring + 1) {
        ring += 1;
    }
    let side = 2 * ring + 1;
    let place = if ring == 0 { 0 } else { number - (side - 2) * (side - 2) };
    let between = 2 * (side - 2).max(0);
    if place < side {
        (-ring, place - ring)
    } else if place < side + between {
        let inside = place - side;
        (1 - ring + inside / 2, if inside % 2 == 0 { -ring } else { ring })
    } else {
        (ring, place - side - between - ring)
    }
}

/// Tiles that are loaded.
const TILES_AROUND: usize = ((2 * AROUND + 1) * (2 * AROUND + 1)) as usize;

/// Loading the surfaces around a place, some points at a time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Loading {
    place: (i16, i16),
    tile: usize,
    point: usize,
}

impl Loading {
    /// Begins to load what is around a position, m; None if it is beyond all tiles.
    pub(super) fn begin<const ROOM: usize>(x: f64, y: f64, submap: &mut Submap<ROOM>) -> Option<Self> {
        let place = Tile::place_of(x, y)?;
        submap.begin(&middle(place));
        Some(Self { place, tile: 0, point: 0 })
    }

    /// Adds at most `count` points of one tile; whether there are more.
    pub(super) fn step<const ROOM: usize>(&mut self, map: &KeptMap, count: usize, submap: &mut Submap<ROOM>) -> bool {
        if map.load_part(self.place, self.tile, (self.point, count), submap) < count {
            (self.tile, self.point) = (self.tile + 1, 0);
        } else {
            self.point += count;
        }
        self.tile < TILES_AROUND
    }
}

/// The middle of a tile.
pub(super) fn middle((row, column): (i16, i16)) -> Pose {
    let middle = |index: i16| (f64::from(index) + 0.5) * TILE;
    Pose::new(middle(column), middle(row), 0.0)
}

/// What is around the vehicle of a map that is larger, in a submap with room for `ROOM` points.
#[derive(Clone, Debug, Default)]
pub struct Surroundings<const ROOM: usize = 6144> {
    submap: Submap<ROOM>,
    place: Option<(i16, i16)>,
}

/// The submap is loaded anew where the vehicle has come so far out of the tile in whose middle it stands, m.
const OUTSIDE: f64 = LARGEST_REACH as f64;

impl<const ROOM: usize> Surroundings<ROOM> {
    /// Nothing is loaded.
    #[must_use]
    pub const fn new() -> Self {
        Self { submap: Submap::new(), place: None }
    }

    /// The map has been replaced.
    pub const fn forget(&mut self) {
        self.place = None;
    }

    /// The surfaces of key scans around a pose, instead of those of a map.
    pub fn of_keys<const KEYS: usize, const POINTS: usize>(&mut self, pose: &Pose, keys: &KeyRing<KEYS, POINTS>) {
        self.place = None;
        self.submap.surround(pose, keys);
    }

    /// The surfaces that were loaded last.
    #[must_use]
    pub const fn loaded(&self) -> &Submap<ROOM> {
        &self.submap
    }

    /// The surfaces of the map around a pose.
    pub fn around(&mut self, map: &KeptMap, pose: &Pose) -> &Submap<ROOM> {
        let from = self.submap.origin();
        let reach = 0.5 * TILE + OUTSIDE;
        let is_inside = libm::fabs(pose.x - from.x) < reach && libm::fabs(pose.y - from.y) < reach;
        let wanted = Tile::place_of(pose.x, pose.y);
        if (self.place.is_none() || !is_inside)
            && let Some(place) = wanted
        {
            map.load(place, &mut self.submap);
            self.place = wanted;
        }
        &self.submap
    }
}
