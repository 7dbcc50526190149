//! Where a map has surfaces at four scales: what tells whether a scan may have been taken near a place. All but the finest know which way
//! the surfaces face.
//!
//! A cell at each scale stands for itself and those around it: a point that is moved by up to the side of a cell finds all that it may
//! have lain on. So what a place at one scale finds, all finer ones within it cannot exceed: a bound as in the multi-resolution search
//! of E. Olson, "M3RSM: Many-to-many multi-resolution scan matching" (ICRA 2015).

use core::f32::consts::TAU;

use super::bit_planes::BitPlanes;
use crate::contours::{KeptMap, SurfacePoint, TILE};
use crate::geometry::Point;

/// Scales.
pub(super) const LEVELS: usize = 4;
pub(super) const COARSEST: usize = LEVELS - 1;

/// Smallest cell of the finest scale, m.
pub(super) const SMALLEST_CELL: f64 = 0.25;

/// By how much cells grow until the map has room.
const GROWTH: f64 = 1.05;

/// Most such steps: cells of 60 m.
const STEPS: usize = 100;

/// Sectors of directions; the bit behind them is that of corners.
const SECTORS: f32 = 7.0;
const CORNER: u8 = 1 << 7;

/// A surface belongs to the sectors within this of the direction in which it faces, rad.
const BESIDE: f32 = 16.0 * TAU / 360.0;

/// The direction in which a surface faces, rad; none of a corner.
pub(super) fn direction(surface: &SurfacePoint) -> Option<f32> {
    (!surface.is_corner()).then(|| libm::atan2f(surface.normal.y, surface.normal.x))
}

/// The bit of the direction in which a surface faces.
pub(super) fn facing(direction: Option<f32>) -> u8 {
    direction.map_or(CORNER, sector)
}

fn sector(angle: f32) -> u8 {
    // No angle is further below zero.
    let turns = angle * (1.0 / TAU) + 2.0;
    let sector = (turns - turns as u32 as f32) * SECTORS;
    1_u8.checked_shl(sector as u32).unwrap_or(0) & !CORNER
}

/// The scales of a grid, one behind the other.
#[derive(Clone, Copy, Debug, Default)]
struct Area {
    columns: i32,
    rows: i32,
    first: usize,
}

impl Area {
    fn cells(&self) -> usize {
        (self.columns.max(0) as usize).saturating_mul(self.rows.max(0) as usize)
    }

    fn planes(&self) -> BitPlanes {
        BitPlanes::new(self.columns, self.rows)
    }

    /// Bytes at a scale: the finest has a bit for each cell, the coarsest one for each direction.
    fn bytes(&self, level: usize) -> usize {
        match level {
            0 => self.cells().div_ceil(8),
            COARSEST => self.planes().bytes(),
            _ => self.cells(),
        }
    }
}

/// All scales of a map in `CELLS` bytes.
#[derive(Clone, Debug)]
pub(super) struct PlaceGrid<const CELLS: usize> {
    /// Of the map, m.
    corner: Point,
    /// Side of a cell of the finest scale, m.
    cell: f64,
    areas: [Area; LEVELS],
    cells: [u8; CELLS],
}

impl<const CELLS: usize> PlaceGrid<CELLS> {
    #[inline(always)]
    pub(super) const fn new() -> Self {
        let area = Area { columns: 0, rows: 0, first: 0 };
        Self { corner: Point::new(0.0, 0.0), cell: SMALLEST_CELL, areas: [area; LEVELS], cells: [0; CELLS] }
    }

    /// Empties it, and makes its cells as small as there is room for. False if there is no room.
    pub(super) fn begin(&mut self, map: &KeptMap) -> bool {
        self.cells.fill(0);
        self.areas = [Area::default(); LEVELS];
        let Some(first) = map.place(0) else { return false };
        let (mut low, mut high) = (first, first);
        for (row, column) in map.places() {
            low = (low.0.min(row), low.1.min(column));
            high = (high.0.max(row), high.1.max(column));
        }
        let corner = Point::new(f64::from(low.1), f64::from(low.0)) * TILE;
        let side = |low: i16, high: i16| (f64::from(high) - f64::from(low) + 1.0) * TILE;
        let (width, height) = (side(low.1, high.1), side(low.0, high.0));
        self.cell = SMALLEST_CELL;
        for _ in 0..STEPS {
            let mut room = 0;
            // Surfaces at the edge of the map are told by the cells beside it, too.
            let beside = self.cell * f64::from(1 << COARSEST);
            self.corner = corner.add_scalar(-beside);
            for (level, area) in self.areas.iter_mut().enumerate() {
                let cell = self.cell * f64::from(1 << level);
                let count = |length: f64| libm::ceil((length + 2.0 * beside) / cell) as i32;
                *area = Area { columns: count(width), rows: count(height), first: room };
                room = room.saturating_add(area.bytes(level));
            }
            if room <= CELLS {
                return true;
            }
            self.cell *= GROWTH;
        }
        false
    }

    /// Adds a surface at a position, m.
    pub(super) fn add(&mut self, position: &Point, surface: &SurfacePoint) {
        let beside = |angle: f32| sector(angle) | sector(angle - BESIDE) | sector(angle + BESIDE);
        let mask = direction(surface).map_or(CORNER, beside);
        let place = position - self.corner;
        for (level, area) in self.areas.iter().enumerate() {
            let cell = self.cell * f64::from(1 << level);
            let (column, row) = (libm::floor(place.x / cell) as i32, libm::floor(place.y / cell) as i32);
            for y in row - 1..=row + 1 {
                for x in column - 1..=column + 1 {
                    if !(0..area.columns).contains(&x) || !(0..area.rows).contains(&y) {
                        continue;
                    }
                    if level == COARSEST {
                        let bytes = self.cells.get_mut(area.first..).unwrap_or_default();
                        area.planes().mark(bytes, (x, y), mask);
                        continue;
                    }
                    let index = (y * area.columns + x) as usize;
                    let (index, mask) = if level == 0 { (index / 8, 1 << (index % 8)) } else { (index, mask) };
                    if let Some(cell) = self.cells.get_mut(area.first + index) {
                        *cell |= mask;
                    }
                }
            }
        }
    }

    /// A scale, from the finest to the last but the coarsest.
    pub(super) fn level(&self, level: usize) -> Level<'_> {
        let area = self.areas.get(level).copied().unwrap_or_default();
        let cells = self.cells.get(area.first..area.first + area.bytes(level)).unwrap_or_default();
        Level { area, cells, is_finest: level == 0 }
    }

    /// The coarsest scale, and its bytes.
    pub(super) fn coarsest(&self) -> (BitPlanes, &[u8]) {
        let area = self.areas.get(COARSEST).copied().unwrap_or_default();
        (area.planes(), self.cells.get(area.first..).unwrap_or_default())
    }

    /// Whether there are surfaces within about a cell of the finest scale of a position, m.
    pub(super) fn is_near(&self, position: &Point) -> bool {
        let place = (position - self.corner) / self.cell;
        let cell = (libm::floor(place.x) as i32, libm::floor(place.y) as i32);
        self.level(0).hits(&[Offset::default()], cell, 1).0 > 0
    }

    /// Side of a cell of the finest scale, m.
    pub(super) fn cell(&self) -> f64 {
        self.cell
    }

    /// The middle of a cell of the finest scale, m.
    pub(super) fn middle(&self, column: i32, row: i32) -> Point {
        self.corner + Point::new(f64::from(column) + 0.5, f64::from(row) + 0.5) * self.cell
    }
}

/// So many misses, and half of all, are refused before all points are looked up: of a place where six in ten lie on surfaces, and whose
/// points come in no order, one in some hundred is.
const EARLY: usize = 4;

/// One scale.
#[derive(Clone, Copy, Debug)]
pub(super) struct Level<'a> {
    area: Area,
    cells: &'a [u8],
    is_finest: bool,
}

/// A point of a scan from where the laser is: columns and rows away, and the bit of its direction.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Offset {
    pub column: i16,
    pub row: i16,
    pub facing: u8,
}

impl Level<'_> {
    pub(super) fn columns(&self) -> i32 {
        self.area.columns
    }

    pub(super) fn rows(&self) -> i32 {
        self.area.rows
    }

    /// How many of the points may lie on surfaces if the laser is in a cell; 0 as soon as they must be fewer than `needed`. Behind it the
    /// number of points that were looked up.
    #[inline]
    pub(super) fn hits(&self, offsets: &[Offset], (column, row): (i32, i32), needed: usize) -> (usize, u32) {
        let most = offsets.len().saturating_sub(needed);
        let (mut misses, mut looked_up) = (0, 0);

        for offset in offsets {
            let (x, y) = (column + i32::from(offset.column), row + i32::from(offset.row));
            let is_inside = (x as u32) < self.area.columns as u32 && (y as u32) < self.area.rows as u32;
            let index = (y as u32).wrapping_mul(self.area.columns as u32).wrapping_add(x as u32) as usize;
            let (index, mask) = if self.is_finest { (index >> 3, 1 << (index & 7)) } else { (index, offset.facing) };
            let is_hit = is_inside && self.cells.get(index).is_some_and(|cell| cell & mask != 0);
            looked_up += 1;
            misses += usize::from(!is_hit);
            if misses > most.min(EARLY + looked_up as usize / 2) {
                return (0, looked_up);
            }
        }
        (offsets.len() - misses, looked_up)
    }
}
