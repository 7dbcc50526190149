//! Pairs of reflectors by their distance.

use heapless::Vec;

use super::occupancy::Occupancy;
use crate::geometry::{Point, ScanPoint};
use crate::landmarks::Grid;

/// Width of a bucket of distances, m.
const BUCKET: f32 = 0.02;

/// Number of buckets; longer pairs are not kept.
const BUCKETS: usize = 3200;

/// Up to `PAIRS` pairs of reflectors, the shortest ones, sorted by distance into buckets of 2 cm.
#[derive(Clone, Debug)]
pub struct PairIndex<const PAIRS: usize> {
    pairs: Vec<(u16, u16), PAIRS>,
    /// Where each bucket begins among the pairs, and at the end where the last one ends.
    starts: [u32; BUCKETS + 1],
    /// Buckets that are complete.
    complete: usize,
}

impl<const PAIRS: usize> PairIndex<PAIRS> {
    const fn new() -> Self {
        Self { pairs: Vec::new(), starts: [0; BUCKETS + 1], complete: 0 }
    }

    /// Sorts pairs no longer than `farthest` (m) into buckets, in two passes over all pairs.
    fn build(&mut self, points: &[ScanPoint], farthest: f32) {
        self.starts = [0; BUCKETS + 1];
        self.pairs.clear();
        each_pair(points, farthest, |bucket, _, _| {
            if let Some(count) = self.starts.get_mut(bucket + 1) {
                *count += 1;
            }
        });
        let mut total = 0_u32;
        self.complete = 0;
        let mut is_full = false;
        for (bucket, count) in self.starts.iter_mut().skip(1).enumerate() {
            is_full |= total + *count > PAIRS as u32;
            if is_full {
                *count = total;
            } else {
                total += *count;
                *count = total;
                self.complete = bucket + 1;
            }
        }
        // There is room for as many as were counted.
        let _ = self.pairs.resize(total as usize, (0, 0));
        let complete = self.complete;
        each_pair(points, farthest, |bucket, first, second| {
            if bucket < complete
                && let Some(start) = self.starts.get_mut(bucket)
            {
                if let Some(slot) = self.pairs.get_mut(*start as usize) {
                    *slot = (first, second);
                }
                *start += 1;
            }
        });
        // Filling has moved the beginning of each bucket to its end.
        self.starts.copy_within(..BUCKETS, 1);
        if let Some(first) = self.starts.first_mut() {
            *first = 0;
        }
    }

    /// Positions in the index of the pairs whose distance lies within `tolerance` of `distance`, m, and at most a bucket
    /// further. None if the index does not hold all of them.
    pub(super) fn range(&self, distance: f32, tolerance: f32) -> Option<core::ops::Range<u32>> {
        let from = ((distance - tolerance) / BUCKET).max(0.0) as usize;
        let to = ((distance + tolerance) / BUCKET) as usize + 1;
        if to > self.complete {
            return None;
        }
        Some(*self.starts.get(from)?..*self.starts.get(to)?)
    }

    pub(super) fn pair(&self, position: u32) -> Option<(u16, u16)> {
        self.pairs.get(position as usize).copied()
    }

    /// Number of pairs.
    #[must_use]
    pub fn len(&self) -> usize {
        self.pairs.len()
    }

    /// Whether there is no pair.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    /// All pairs up to this distance are in the index, m.
    #[must_use]
    pub fn complete_to(&self) -> f32 {
        self.complete as f32 * BUCKET
    }
}

fn each_pair(points: &[ScanPoint], farthest: f32, mut visit: impl FnMut(usize, u16, u16)) {
    for (first, point) in (0_u16..).zip(points) {
        for (second, other) in (0_u16..).zip(points).skip(usize::from(first) + 1) {
            let distance = (other - point).norm();
            if distance <= farthest {
                visit((distance / BUCKET) as usize, first, second);
            }
        }
    }
}

/// Why reflectors cannot be indexed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReflectorIndexError {
    /// There are more reflectors than there is room for.
    Full,
    /// A position is not finite.
    NotFinite,
}

/// A map of up to `REFLECTORS` reflectors with what a search without a prior needs: up to `PAIRS` pairs by distance (4
/// bytes each, and 13 kB), a bitmap of where reflectors are (16 kB), and a grid.
#[derive(Clone, Debug)]
pub struct ReflectorIndex<const REFLECTORS: usize = 1024, const PAIRS: usize = 60_000> {
    pub(super) points: Vec<ScanPoint, REFLECTORS>,
    pub(super) pairs: PairIndex<PAIRS>,
    pub(super) occupancy: Occupancy,
    grid: Grid<REFLECTORS>,
}

/// Points within this distance of a reflector count as near in the first look, m.
const REACH: f32 = 0.35;

/// Cell of the grid, m.
const CELL: f64 = 1.0;

impl<const REFLECTORS: usize, const PAIRS: usize> Default for ReflectorIndex<REFLECTORS, PAIRS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const REFLECTORS: usize, const PAIRS: usize> ReflectorIndex<REFLECTORS, PAIRS> {
    /// An empty index.
    #[must_use]
    pub const fn new() -> Self {
        Self { points: Vec::new(), pairs: PairIndex::new(), occupancy: Occupancy::new(), grid: Grid::new(CELL) }
    }

    /// Indexes reflectors given by their positions in W, m. Pairs longer than `farthest` (m), which are never seen
    /// together, are left out; if there are still too many, so are the longest.
    ///
    /// # Errors
    /// See [`ReflectorIndexError`]; the index is then empty.
    pub fn build(&mut self, positions: impl Iterator<Item = Point>, farthest: f32) -> Result<(), ReflectorIndexError> {
        self.points.clear();
        let mut outcome = Ok(());
        for position in positions {
            if !(position.x.is_finite() && position.y.is_finite()) {
                outcome = Err(ReflectorIndexError::NotFinite);
            } else if self.points.push(position.cast()).is_err() {
                outcome = Err(ReflectorIndexError::Full);
            }
        }
        if outcome.is_err() {
            self.points.clear();
        }
        self.pairs.build(&self.points, farthest);
        self.occupancy.build(&self.points, REACH);
        self.grid.build(self.points.iter().map(|point| point.cast()));
        outcome
    }

    /// The pairs.
    #[must_use]
    pub fn pairs(&self) -> &PairIndex<PAIRS> {
        &self.pairs
    }

    /// The nearest reflector within `radius` (m, at most 1) of a point, and the squared distance.
    pub(super) fn nearest(&self, point: ScanPoint, radius: f32) -> Option<(u16, f32)> {
        let mut best = None;
        let mut limit = radius * radius;
        for number in self.grid.near(point.cast(), f64::from(radius)) {
            if let Some(other) = self.points.get(number) {
                let square = (other - point).norm_squared();
                if square <= limit {
                    limit = square;
                    best = Some((number as u16, square));
                }
            }
        }
        best
    }
}
