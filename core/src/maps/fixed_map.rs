//! A map that does not change while the vehicle drives: surveyed reflectors, or features mapped beforehand (K 5.6).

use heapless::Vec;

use super::grid::GridView;
use super::{Grid, Landmark};
use crate::geometry::Point;

/// Why a landmark was not taken into the map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapError {
    /// The map is full.
    Full,
    /// The position or its deviation is not finite, or the deviation is negative.
    NotFinite,
}

/// Edge of a cell of the index, m: about the distance between reflectors, and well above the radius of association.
pub(super) const CELL: f64 = 2.0;

/// Up to `LANDMARKS` landmarks with a spatial index.
#[derive(Clone, Debug)]
pub struct FixedMap<const LANDMARKS: usize> {
    landmarks: Vec<Landmark, LANDMARKS>,
    grid: Grid<LANDMARKS>,
}

impl<const LANDMARKS: usize> Default for FixedMap<LANDMARKS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const LANDMARKS: usize> FixedMap<LANDMARKS> {
    /// An empty map.
    #[must_use]
    pub const fn new() -> Self {
        Self { landmarks: Vec::new(), grid: Grid::new(CELL) }
    }

    /// Adds landmarks and indexes the map anew.
    ///
    /// # Errors
    /// [`MapError`] for the first landmark that does not fit; those before it are in the map.
    pub fn extend(&mut self, landmarks: &[Landmark]) -> Result<(), MapError> {
        let outcome = landmarks.iter().try_for_each(|landmark| {
            if !landmark.is_finite() {
                return Err(MapError::NotFinite);
            }
            self.landmarks.push(*landmark).map_err(|_| MapError::Full)
        });
        self.grid.build(self.landmarks.iter().map(Landmark::position));
        outcome
    }

    /// Removes all landmarks.
    pub fn clear(&mut self) {
        self.landmarks.clear();
        self.grid.build(core::iter::empty());
    }

    /// All landmarks, in the order in which they were added.
    #[must_use]
    pub fn landmarks(&self) -> &[Landmark] {
        &self.landmarks
    }

    /// The map without its capacity.
    #[inline]
    #[must_use]
    pub fn view(&self) -> MapView<'_> {
        MapView::new(&self.landmarks, self.grid.view())
    }

    /// See [`MapView::nearest`].
    #[inline]
    #[must_use]
    pub fn nearest(&self, point: Point, radius: f64) -> Option<(&Landmark, f64)> {
        self.view().nearest(point, radius)
    }

    /// See [`MapView::near`].
    #[inline]
    pub fn near(&self, point: Point, radius: f64) -> impl Iterator<Item = &Landmark> {
        self.view().near(point, radius)
    }
}

/// A [`FixedMap`] of any capacity.
#[derive(Clone, Copy, Debug)]
pub struct MapView<'a> {
    landmarks: &'a [Landmark],
    grid: GridView<'a>,
}

impl<'a> MapView<'a> {
    #[inline]
    pub(super) fn new(landmarks: &'a [Landmark], grid: GridView<'a>) -> Self {
        Self { landmarks, grid }
    }

    /// All landmarks, in the order in which they were added.
    #[must_use]
    pub fn landmarks(&self) -> &'a [Landmark] {
        self.landmarks
    }

    /// The landmark nearest to `point` and the squared distance, m^2; none beyond `radius` (m, at most three cells of 2 m).
    #[inline]
    #[must_use]
    pub fn nearest(&self, point: Point, radius: f64) -> Option<(&'a Landmark, f64)> {
        let mut limit = radius * radius;
        let mut best = None;
        for landmark in self.grid.near(point, radius).filter_map(|index| self.landmarks.get(index)) {
            let square = (landmark.position() - point).norm_squared();
            if square <= limit {
                limit = square;
                best = Some((landmark, square));
            }
        }
        best
    }

    /// The landmarks within `radius` (m, at most three cells of 2 m) of `point`.
    #[inline]
    pub fn near(&self, point: Point, radius: f64) -> impl Iterator<Item = &'a Landmark> + use<'a> {
        let landmarks = self.landmarks;
        self.grid
            .near(point, radius)
            .filter_map(move |index| landmarks.get(index))
            .filter(move |landmark| libm::hypot(landmark.x - point.x, landmark.y - point.y) <= radius)
    }
}
