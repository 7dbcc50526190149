//! The surfaces around a place: points looked up by cell, and a grid for the search.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::likelihood_grid::HALF;
use super::{KeyRing, LikelihoodGrid, PackedPoint, SurfacePoint};
use crate::geometry::{Pose, ScanPoint, Transform};

/// Size of a cell, m: what is within half of it lies in four cells.
const CELL: f32 = 0.6;

/// Largest distance at which points are looked up, m.
pub const LARGEST_REACH: f32 = 0.5 * CELL;

/// Cells along a side.
const SIDE: usize = 54;

/// Points nearer than this are one if they face the same way, m.
const SAME: f32 = 0.025;

/// No point.
const NONE: u16 = u16::MAX;

/// A point and the next one of its cell.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Entry {
    point: PackedPoint,
    next: u16,
}

/// The number of the first point of each cell of a row.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Row(#[serde(with = "crate::arrays")] [u16; SIDE]);

impl Row {
    const EMPTY: Self = Self([NONE; SIDE]);
}

/// At most `ROOM` points within 16 m of a place along each axis.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Submap<const ROOM: usize> {
    /// Where its frame is.
    origin: Pose,
    entries: Vec<Entry, ROOM>,
    /// Nothing before the submap is begun for the first time: what would be built here would be built on the stack.
    first: Vec<Row, SIDE>,
    grid: LikelihoodGrid,
    /// The points from this number on lie over the others: they count where none of those is near.
    overlay: usize,
    /// How many points may be in it now.
    room: usize,
    has_cut: bool,
}

impl<const ROOM: usize> Submap<ROOM> {
    /// Nothing around; it is to be begun before something is added.
    #[must_use]
    #[inline(always)]
    pub const fn new() -> Self {
        const { assert!(ROOM < NONE as usize) };
        Self {
            origin: Pose { x: 0.0, y: 0.0, theta: 0.0 },
            entries: Vec::new(),
            first: Vec::new(),
            grid: LikelihoodGrid::new(),
            overlay: ROOM,
            room: ROOM,
            has_cut: false,
        }
    }

    /// Empties it, and puts its frame at the position of a pose, its axes along those of the pose's reference frame.
    pub fn begin(&mut self, place: &Pose) {
        self.origin = Pose { theta: 0.0, ..*place };
        self.entries.clear();
        self.first.fill(Row::EMPTY);
        // As many as there is room for.
        let _ = self.first.resize(SIDE, Row::EMPTY);
        self.grid.clear();
        (self.overlay, self.room) = (ROOM, ROOM);
        self.has_cut = false;
    }

    /// Leaves room for an overlay: no more than so many points are added before it begins.
    pub fn leave_room(&mut self, points: usize) {
        self.room = points.min(ROOM);
    }

    /// What is added from now on lies over what was added before: it counts where nothing else is near.
    pub fn begin_overlay(&mut self) {
        (self.overlay, self.room) = (self.entries.len(), ROOM);
    }

    /// Begins at a pose with the surfaces of key scans around it.
    pub fn surround<const KEYS: usize, const POINTS: usize>(&mut self, place: &Pose, keys: &KeyRing<KEYS, POINTS>) {
        self.begin(place);
        for key in keys.iter() {
            self.add(&key.pose, key.points.iter());
        }
    }

    /// Whether something lies over the rest.
    #[must_use]
    pub fn has_overlay(&self) -> bool {
        self.entries.len() > self.overlay
    }

    /// Where its frame is.
    #[must_use]
    pub const fn origin(&self) -> &Pose {
        &self.origin
    }

    /// Whether nothing is in it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether there was no room for all.
    #[must_use]
    pub const fn has_cut(&self) -> bool {
        self.has_cut
    }

    /// Whether a position of its own frame is not too far away.
    #[must_use]
    pub fn reaches(position: &ScanPoint) -> bool {
        libm::fabsf(position.x) < HALF && libm::fabsf(position.y) < HALF
    }

    /// Whether all that is at a position of its own frame is in it: it is not too far away, and there was room.
    #[must_use]
    pub fn holds(&self, position: &ScanPoint) -> bool {
        !self.has_cut && Self::reaches(position)
    }

    /// Some of its points: at most `count` from number `first` on.
    pub(super) fn points(&self, first: usize, count: usize) -> impl Iterator<Item = SurfacePoint> + '_ {
        self.entries.iter().skip(first).take(count).map(|entry| entry.point.unpacked())
    }

    /// The grid for the search.
    #[must_use]
    pub const fn grid(&self) -> &LikelihoodGrid {
        &self.grid
    }

    /// Adds points that were seen from a pose, except those that are in it already.
    pub fn add<'a>(&mut self, pose: &Pose, points: impl Iterator<Item = &'a PackedPoint>) {
        let transform = Transform::of(&self.origin.between(pose));
        for point in points {
            self.add_point(&point.unpacked().moved(&transform));
        }
    }

    /// Adds a point of its own frame, unless it is in it already or too far away.
    pub fn add_point(&mut self, point: &SurfacePoint) {
        if !Self::reaches(&point.position) || self.nearest(point, SAME).is_some() {
            return;
        }
        let (Some(packed), Some(first)) = (PackedPoint::of(point), self.first_mut(&point.position)) else { return };
        let next = *first;
        if self.entries.len() >= self.room {
            self.has_cut = true;
            return;
        }
        let number = self.entries.len() as u16;
        if let Some(first) = self.first_mut(&point.position) {
            *first = number;
        }
        // There is room.
        let _ = self.entries.push(Entry { point: packed, next });
        self.grid.add(&point.position);
    }

    /// The nearest point of the same kind that faces the same way, if it is within `reach` (m, at most [`LARGEST_REACH`]); one of the overlay
    /// only if there is no other.
    #[must_use]
    pub fn nearest(&self, point: &SurfacePoint, reach: f32) -> Option<SurfacePoint> {
        self.nearest_of_either(point, reach).map(|(point, _)| point)
    }

    /// The same, and whether it is of the overlay.
    pub(super) fn nearest_of_either(&self, point: &SurfacePoint, reach: f32) -> Option<(SurfacePoint, bool)> {
        let sought = PackedPoint::of(point)?;
        let reach_in_counts = reach * 1000.0;
        let farthest = (reach_in_counts * reach_in_counts) as u32;
        let (mut below, mut over) = ((farthest, None), (farthest, None));
        let (low, high) = (Self::column(point.position.x - reach), Self::column(point.position.x + reach));
        let (bottom, top) = (Self::column(point.position.y - reach), Self::column(point.position.y + reach));
        for row in self.first.get(bottom..=top)? {
            for first in row.0.get(low..=high)? {
                let mut number = *first;
                // A chain is no longer than there are points.
                for _ in 0..ROOM {
                    let Some(entry) = self.entries.get(usize::from(number)) else { break };
                    let best = if usize::from(number) < self.overlay { &mut below } else { &mut over };
                    number = entry.next;
                    let square = entry.point.square(&sought);
                    if square < best.0 && entry.point.is_like(&sought) {
                        *best = (square, Some(entry.point));
                    }
                }
            }
        }
        let unpacked = |(_, point): (u32, Option<PackedPoint>)| point.map(|point| point.unpacked());
        unpacked(below).map(|point| (point, false)).or_else(|| unpacked(over).map(|point| (point, true)))
    }

    /// The column, or row, of a coordinate, the nearest one if it is outside.
    fn column(length: f32) -> usize {
        let column = (length + 0.5 * SIDE as f32 * CELL) * (1.0 / CELL);
        (column.max(0.0) as usize).min(SIDE - 1)
    }

    fn first_mut(&mut self, position: &ScanPoint) -> Option<&mut u16> {
        self.first.get_mut(Self::column(position.y))?.0.get_mut(Self::column(position.x))
    }
}

impl<const ROOM: usize> Default for Submap<ROOM> {
    fn default() -> Self {
        Self::new()
    }
}
