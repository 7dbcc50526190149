//! A map of contours that is kept: points of surfaces in square tiles, of which those around the vehicle are loaded.
//!
//! It is bytes in memory that somebody else holds, as in flash: a header ([`KeptMap::header`]: what it is, and the number of tiles), the
//! tiles in order of their places ([`Tile::bytes`]), and the points in order of their tiles, and within them of their columns
//! ([`KeptPoint::bytes`]).

use super::{KeptPoint, Submap, SurfacePoint, TILE, Tile};
use crate::geometry::{Point, Pose, ScanPoint};

/// Tiles to each side that are loaded: they reach as far as a submap does.
const AROUND: i32 = 4;

/// Bytes before the tiles.
const HEADER: usize = 8;

/// What a map begins with: `AGC` and the number of this format.
const FORMAT: u32 = 0x0143_4741;

/// Why a map cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KeptMapError {
    /// The bytes do not begin as a map, or end within a tile or a point.
    Format,
    /// Tiles are not in order of their rows and columns, each once, or points of a tile not in order of their columns.
    Order,
    /// The tiles have more or fewer points than there are, or end before they begin.
    Points,
    /// The localiser has no room for contours.
    NoRoom,
}

/// A map in memory that somebody else holds.
#[derive(Clone, Copy, Debug)]
pub struct KeptMap<'a> {
    tiles: &'a [[u8; Tile::BYTES]],
    points: &'a [[u8; KeptPoint::BYTES]],
}

impl<'a> KeptMap<'a> {
    /// A map without tiles.
    pub const EMPTY: Self = Self { tiles: &[], points: &[] };

    /// What the bytes of a map of so many tiles begin with.
    #[must_use]
    pub const fn header(tiles: u32) -> [u8; HEADER] {
        let ([a, b, c, d], [e, f, g, h]) = (FORMAT.to_le_bytes(), tiles.to_le_bytes());
        [a, b, c, d, e, f, g, h]
    }

    /// Takes bytes as a map.
    ///
    /// # Errors
    /// See [`KeptMapError`].
    pub fn read(bytes: &'a [u8]) -> Result<Self, KeptMapError> {
        let (header, rest) = bytes.split_first_chunk::<HEADER>().ok_or(KeptMapError::Format)?;
        let ([format, count], []) = header.as_chunks::<4>() else { return Err(KeptMapError::Format) };
        let count = u32::from_le_bytes(*count) as usize;
        let length = count.checked_mul(Tile::BYTES).filter(|_| u32::from_le_bytes(*format) == FORMAT);
        let (tiles, points) = length.and_then(|length| rest.split_at_checked(length)).ok_or(KeptMapError::Format)?;
        let (tiles, []) = tiles.as_chunks() else { return Err(KeptMapError::Format) };
        let (points, []) = points.as_chunks() else { return Err(KeptMapError::Format) };
        let map = Self { tiles, points };
        let each = || tiles.iter().map(|bytes| Tile::of_bytes(*bytes));
        if !each().is_sorted_by(|before, after| before.place < after.place) {
            return Err(KeptMapError::Order);
        }
        let ends = each().map(|tile| tile.end as usize);
        if !ends.clone().is_sorted() || ends.max().unwrap_or(0) != points.len() {
            return Err(KeptMapError::Points);
        }
        let is_in_order = (0..tiles.len()).all(|number| map.points_of(number).columns().is_sorted());
        if is_in_order { Ok(map) } else { Err(KeptMapError::Order) }
    }

    /// Number of points.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether it holds nothing.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Fills a submap with what is around a place, from near to far, at most so many points. The submap says whether there was room for
    /// all.
    pub fn load<const ROOM: usize>(&self, place: (i16, i16), most: usize, submap: &mut Submap<ROOM>) {
        submap.begin(&middle(place));
        submap.leave_room(most);
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
        let (down, right) = around(number as i32);
        let shift = corner_of(down, right);
        let points = self.beside(place, (down, right)).some(first, count);
        let added = points.len();
        for point in points {
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
                let shift = corner_of(down, right);
                let points = self.beside(place, (down, right)).between(position.x - shift.x, reach);
                for point in points.some(0, usize::MAX) {
                    let position_of_it = point.position + shift;
                    if (position_of_it - position).amax() <= reach {
                        with(SurfacePoint { position: position_of_it, ..point });
                    }
                }
                looked_at = looked_at.saturating_add(points.len() as u32);
            }
        }
        looked_at
    }

    /// The nearest point of the same kind that faces the same way, if it is within `reach` (m), and how many points were looked at; all in
    /// the frame in the middle of a tile.
    pub(super) fn nearest(&self, place: (i16, i16), point: &SurfacePoint, reach: f32) -> (Option<SurfacePoint>, u32) {
        let (mut square, mut nearest) = (reach * reach, None);
        let looked_at = self.for_each_near(place, &point.position, reach, |other| {
            let square_of_it = (other.position - point.position).norm_squared();
            if square_of_it < square && other.is_like(point) {
                (square, nearest) = (square_of_it, Some(other));
            }
        });
        (nearest, looked_at)
    }

    /// The points of the tile so many rows and columns from a place; none if there is no such tile.
    fn beside(&self, place: (i16, i16), (down, right): (i32, i32)) -> Points<'a> {
        let place_beside = || {
            let row = i16::try_from(i32::from(place.0).checked_add(down)?).ok()?;
            let column = i16::try_from(i32::from(place.1).checked_add(right)?).ok()?;
            Some((row, column))
        };
        let number = place_beside()
            .and_then(|sought| self.tiles.binary_search_by(|tile| Tile::of_bytes(*tile).place.cmp(&sought)).ok());
        number.map_or(Points(&[]), |number| self.points_of(number))
    }

    /// All surfaces: the corner of the tile, m in W, and the point from there.
    pub fn surfaces(&self) -> impl Iterator<Item = (Point, SurfacePoint)> + use<'a> {
        let map = *self;
        map.places().enumerate().flat_map(move |(number, place)| {
            map.points_of(number).some(0, usize::MAX).map(move |point| (corner(place), point))
        })
    }

    /// The places of all tiles, in order.
    pub(super) fn places(&self) -> impl Iterator<Item = (i16, i16)> + use<'a> {
        self.tiles.iter().map(|tile| Tile::of_bytes(*tile).place)
    }

    /// The place of the tile with that number.
    pub(super) fn place(&self, number: usize) -> Option<(i16, i16)> {
        Some(Tile::of_bytes(*self.tiles.get(number)?).place)
    }

    /// The points of the tile with that number.
    pub(super) fn points_of(&self, number: usize) -> Points<'a> {
        let end = |number: usize| self.tiles.get(number).map_or(0, |tile| Tile::of_bytes(*tile).end as usize);
        let first = number.checked_sub(1).map_or(0, end);
        Points(self.points.get(first..end(number)).unwrap_or_default())
    }
}

/// Points of a tile.
#[derive(Clone, Copy)]
pub(super) struct Points<'a>(&'a [[u8; KeptPoint::BYTES]]);

impl<'a> Points<'a> {
    pub(super) const fn len(self) -> usize {
        self.0.len()
    }

    /// The counts of each along the first axis.
    fn columns(self) -> impl Iterator<Item = u16> + use<'a> {
        self.0.iter().map(|bytes| KeptPoint::of_bytes(*bytes).column())
    }

    /// Those within `reach` of a coordinate along the first axis, from the corner of the tile, m.
    fn between(self, middle: f32, reach: f32) -> Self {
        let column = |bytes: &[u8; KeptPoint::BYTES]| KeptPoint::of_bytes(*bytes).column();
        let (low, high) = (KeptPoint::column_of(middle - reach), KeptPoint::column_of(middle + reach));
        let first = self.0.partition_point(|bytes| column(bytes) < low);
        let end = self.0.partition_point(|bytes| column(bytes) <= high);
        Self(self.0.get(first..end).unwrap_or_default())
    }

    /// At most `count` of them from number `first` on, each from the corner of the tile.
    pub(super) fn some(self, first: usize, count: usize) -> impl ExactSizeIterator<Item = SurfacePoint> + use<'a> {
        self.0.iter().skip(first).take(count).map(|bytes| KeptPoint::of_bytes(*bytes).unpacked())
    }
}

/// The corner of a tile, m in W.
pub(super) fn corner((row, column): (i16, i16)) -> Point {
    Point::new(f64::from(column), f64::from(row)) * TILE
}

/// The corner of a tile so many rows and columns away, from the middle of the tile here.
fn corner_of(down: i32, right: i32) -> ScanPoint {
    let corner = |steps: i32| (f64::from(steps) - 0.5) as f32 * TILE as f32;
    ScanPoint::new(corner(right), corner(down))
}

/// The tiles around a place by number, ring by ring: rows and columns away.
fn around(number: i32) -> (i32, i32) {
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
