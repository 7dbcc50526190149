//! Laying a scan onto all of a kept map: surfaces beyond the reach of a submap hold the pose where those nearby are few.

use crate::contours::kept_map::middle;
use crate::contours::refinement::{Refinement, Refining};
use crate::contours::{KeptMap, SurfacePoint, Tile};
use crate::geometry::Pose;

/// Points of a scan that are taken in one step.
const POINTS_A_STEP: usize = 8;

/// A scan on its way to where its points lie on surfaces, some points at a time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Settling {
    /// The tile in whose middle the frame is.
    place: (i16, i16),
    refining: Refining,
}

impl Settling {
    /// Begins at a pose in the map; None if it is beyond all tiles.
    pub(super) fn begin(pose: &Pose) -> Option<Self> {
        let place = Tile::place_of(pose.x, pose.y)?;
        Some(Self { place, refining: Refining::new(middle(place).between(pose)) })
    }

    /// Takes some points of a scan; how many of the map were looked at, and whether there is more to do.
    pub(super) fn step(&mut self, points: &[SurfacePoint], map: &KeptMap) -> (u32, bool) {
        let (place, mut looked_at) = (self.place, 0_u32);
        let goes_on = self.refining.step(points, POINTS_A_STEP, |moved, reach| {
            let (surface, seen) = map.nearest(place, moved, reach);
            looked_at = looked_at.saturating_add(seen);
            surface
        });
        (looked_at, goes_on)
    }

    /// Where it has come to: the pose in the map, and what the surfaces say of it.
    pub(super) fn outcome(&self) -> Option<(Pose, Refinement)> {
        let found = self.refining.outcome()?;
        Some((middle(self.place).compose(&found.pose), found))
    }
}
