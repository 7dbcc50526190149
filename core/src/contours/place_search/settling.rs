//! Laying a scan onto all of a kept map: surfaces beyond the reach of a submap hold the pose where those nearby are few.

use crate::contours::kept_map::middle;
use crate::contours::refinement::{Refinement, Refining, Sums};
use crate::contours::{KeptMap, SurfacePoint, Tile};
use crate::geometry::Pose;

/// Points of a scan that are taken in one step.
const POINTS_A_STEP: usize = 16;

/// A scan on its way to where its points lie on surfaces, some points at a time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Settling {
    /// The tile in whose middle the frame is.
    place: (i16, i16),
    refining: Refining,
    sums: Sums,
    point: usize,
}

impl Settling {
    /// Begins at a pose in the map; None if it is beyond all tiles.
    pub(super) fn begin(pose: &Pose) -> Option<Self> {
        let place = Tile::place_of(pose.x, pose.y)?;
        let refining = Refining::new(middle(place).between(pose));
        Some(Self { place, refining, sums: Sums::default(), point: 0 })
    }

    /// Takes some points of a scan; how many of the map were looked at, and whether there is more to do.
    pub(super) fn step(&mut self, points: &[SurfacePoint], map: &KeptMap) -> (u32, bool) {
        let (transform, reach) = self.refining.look();
        let mut looked_at: u32 = 0;
        for point in points.iter().skip(self.point).take(POINTS_A_STEP) {
            let moved = point.moved(&transform);
            let (mut nearest, mut surface) = (reach * reach, None);
            let seen = map.for_each_near(self.place, &moved.position, reach, |other| {
                let square = (other.position - moved.position).norm_squared();
                if square < nearest && other.is_like(&moved) {
                    (nearest, surface) = (square, Some(other));
                }
            });
            looked_at = looked_at.saturating_add(seen);
            if let Some(surface) = surface {
                self.sums.lay(&moved, &surface, &transform);
            }
        }
        self.point += POINTS_A_STEP;
        if self.point < points.len() {
            return (looked_at, true);
        }
        let sums = core::mem::take(&mut self.sums);
        self.point = 0;
        (looked_at, self.refining.finish(&sums))
    }

    /// Where it has come to: the pose in the map, and what the surfaces say of it.
    pub(super) fn outcome(&self) -> Option<(Pose, Refinement)> {
        let found = self.refining.outcome()?;
        Some((middle(self.place).compose(&found.pose), found))
    }
}
