//! What is loaded of a kept map, or of key scans, around the vehicle.

use super::matcher::settle;
use super::{ContourMatch, KeptMap, KeyRing, LARGEST_REACH, Prediction, Submap, SurfacePoint, TILE, Tile, align};
use crate::geometry::Pose;

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
    #[inline(always)]
    pub const fn new() -> Self {
        Self { submap: Submap::new(), place: None }
    }

    /// The surfaces are loaded anew before they are matched with again: the map has been replaced, or the memory was lent.
    pub const fn load_anew(&mut self) {
        self.place = None;
    }

    /// Its memory, for somebody else who loads what he likes of the same map.
    pub const fn lend(&mut self) -> &mut Submap<ROOM> {
        self.place = None;
        &mut self.submap
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

    /// Where points were seen by the surfaces of the map: those around, and then by those further away as well. None if they say nothing of
    /// it.
    #[must_use]
    pub fn align(&mut self, map: &KeptMap, points: &[SurfacePoint], predicted: &Prediction) -> Option<ContourMatch> {
        let submap = self.around(map, &predicted.pose);
        let found = align(points, submap, predicted)?;
        let Some(place) = self.place else { return Some(found) };
        let submap = &self.submap;
        let nearest = |point: &SurfacePoint, reach: f32| {
            if Submap::<ROOM>::reaches(&point.position) {
                submap.nearest(point, reach)
            } else {
                map.nearest(place, point, reach).0
            }
        };
        Some(settle(points, submap, &predicted.pose, &found, nearest).unwrap_or(found))
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
