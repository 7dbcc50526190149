//! Landmarks that stay where they are kept, and an index of them.

use super::fixed_map::{CELL, MapView};
use super::{Grid, Landmark};

/// Why a map cannot be lent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LendError {
    /// It has more landmarks than can be indexed.
    Full,
    /// A position or its deviation is not finite, or the deviation is negative.
    NotFinite,
    /// A reflector stands behind a feature ([`super::put_reflectors_first`]).
    Order,
}

/// Up to `LANDMARKS` landmarks that somebody else keeps, with a spatial index. A [`super::FixedMap`] has a copy.
#[derive(Clone, Debug)]
pub struct LentMap<'m, const LANDMARKS: usize> {
    landmarks: &'m [Landmark],
    grid: Grid<LANDMARKS>,
}

impl<const LANDMARKS: usize> Default for LentMap<'_, LANDMARKS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<'m, const LANDMARKS: usize> LentMap<'m, LANDMARKS> {
    /// An empty map.
    #[must_use]
    pub const fn new() -> Self {
        Self { landmarks: &[], grid: Grid::new(CELL) }
    }

    /// Takes these landmarks instead of those before, and indexes them.
    ///
    /// # Errors
    /// [`LendError`] if there are more than `LANDMARKS`, or one is not finite; the map is as before then.
    pub fn lend(&mut self, landmarks: &'m [Landmark]) -> Result<(), LendError> {
        if landmarks.len() > LANDMARKS {
            return Err(LendError::Full);
        }
        if !landmarks.iter().all(Landmark::is_finite) {
            return Err(LendError::NotFinite);
        }
        self.landmarks = landmarks;
        self.grid.build(landmarks.iter().map(Landmark::position));
        Ok(())
    }

    /// The map without its capacity.
    #[inline]
    #[must_use]
    pub fn view(&self) -> MapView<'_> {
        MapView::new(self.landmarks, self.grid.view())
    }
}
