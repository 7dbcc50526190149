//! A map of reflectors with what a search without a prior needs to know of it.

use super::distance_histogram::DistanceHistogram;
use super::occupancy::{Occupancy, OccupancyView};
use super::{ReflectorSnapshot, SeenReflector};
use crate::geometry::{Point, Pose, ScanPoint};
use crate::maps::{Landmark, MapView};

/// Farthest that a reflector is looked for, m.
pub(super) const LARGEST_REACH: f32 = 0.6;

/// Points within this distance of a reflector count as near in the first look, m.
const REACH: f32 = 0.35;

/// Where reflectors are in rough, and how far apart: a bitmap of `WORDS` words of 4 bytes and a histogram of 1.2 kB.
#[derive(Clone, Debug)]
pub struct ReflectorIndex<const WORDS: usize = 4096> {
    /// Positions are told from here where single precision has to suffice, W, m.
    origin: Point,
    occupancy: Occupancy<WORDS>,
    distances: DistanceHistogram,
}

impl<const WORDS: usize> Default for ReflectorIndex<WORDS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const WORDS: usize> ReflectorIndex<WORDS> {
    /// The index of an empty map.
    #[must_use]
    #[inline(always)]
    pub const fn new() -> Self {
        Self { origin: Point::new(0.0, 0.0), occupancy: Occupancy::new(), distances: DistanceHistogram::new() }
    }

    /// Indexes all landmarks of a map, in time that grows with the square of their number.
    pub fn build(&mut self, map: MapView) {
        let positions = map.landmarks().iter().map(Landmark::position);
        self.origin = positions.clone().next().unwrap_or_default();
        let origin = self.origin;
        self.distances.build(positions.clone());
        self.occupancy.build(positions.map(|position| (position - origin).cast()), REACH);
    }

    /// This index with the map that it was built of.
    #[must_use]
    pub fn of<'a>(&'a self, map: MapView<'a>) -> IndexedReflectors<'a> {
        IndexedReflectors { map, origin: self.origin, occupancy: self.occupancy.view(), distances: &self.distances }
    }
}

/// A map and its index: see [`ReflectorIndex::of`].
#[derive(Clone, Copy, Debug)]
pub struct IndexedReflectors<'a> {
    map: MapView<'a>,
    origin: Point,
    occupancy: OccupancyView<'a>,
    pub(super) distances: &'a DistanceHistogram,
}

impl<'a> IndexedReflectors<'a> {
    /// All reflectors.
    pub(super) fn landmarks(&self) -> &'a [Landmark] {
        self.map.landmarks()
    }

    /// Where positions are told from, W, m.
    pub(super) fn origin(&self) -> Point {
        self.origin
    }

    /// The map.
    pub(crate) fn map(&self) -> MapView<'a> {
        self.map
    }

    /// How many of the reflectors of a snapshot that were seen at least so many times the map explains within `gate`
    /// deviations, and how many they are, if the frame of the snapshot is at `pose` in W.
    pub(crate) fn explained<const SEEN: usize>(
        &self,
        snapshot: &ReflectorSnapshot<SEEN>,
        pose: &Pose,
        times: u8,
        gate: f32,
    ) -> (usize, usize) {
        let lasting = || snapshot.reflectors().iter().filter(|seen| seen.times >= times);
        let is_explained = |seen: &&SeenReflector| {
            let reach = (gate * libm::sqrtf(seen.variance)).min(LARGEST_REACH);
            self.map.nearest(pose.transform(&seen.position.cast()), f64::from(reach)).is_some()
        };
        (lasting().filter(is_explained).count(), lasting().count())
    }

    /// Whether there may be a reflector near a point (m, from the origin).
    #[inline]
    pub(super) fn may_be_near(&self, point: ScanPoint) -> bool {
        self.occupancy.is_near(point)
    }

    /// Position (m, from the origin) of the reflector that is nearest to a point within `radius`, m.
    pub(super) fn nearest(&self, point: ScanPoint, radius: f32) -> Option<ScanPoint> {
        let (landmark, _) = self.map.nearest(self.origin + point.cast(), f64::from(radius))?;
        Some((landmark.position() - self.origin).cast())
    }
}
