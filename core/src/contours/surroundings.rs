//! What is loaded of a kept map, or of key scans, around the vehicle.
//!
//! Over the map lies what has been seen of late where it has nothing: things that were moved, or that nobody has mapped. It is learnt in key
//! scans, and forgotten with them; the map stays as it is.

use serde::{Deserialize, Serialize};

use super::matcher::settle;
use super::{ContourMatch, KeptMap, KeyRing, LARGEST_REACH, Prediction, Submap, SurfacePoint, TILE, Tile, align};
use crate::geometry::{Pose, Transform};

/// What is around the vehicle of a map that is larger, in a submap with room for `ROOM` points.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Surroundings<const ROOM: usize = 6144> {
    submap: Submap<ROOM>,
    place: Option<(i16, i16)>,
    /// Key scans that were learnt since it was loaded.
    learnt: usize,
}

/// The submap is loaded anew where the vehicle has come so far out of the tile in whose middle it stands, m.
const OUTSIDE: f64 = LARGEST_REACH as f64;

/// The share of the room that is left for the overlay is one in so many.
const OF_OVERLAY: usize = 8;

/// Fewer points that are not of the map are not worth a key scan.
const WORTH_A_KEY: usize = 10;

impl<const ROOM: usize> Surroundings<ROOM> {
    /// Nothing is loaded.
    #[must_use]
    #[inline(always)]
    pub const fn new() -> Self {
        Self { submap: Submap::new(), place: None, learnt: 0 }
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

    /// Where points were seen by the surfaces of the map with `keys` over it: by those around, and then by those further away as well. None
    /// if they say nothing of it.
    #[must_use]
    pub fn align<const KEYS: usize, const POINTS: usize>(
        &mut self,
        (map, keys): (&KeptMap, &KeyRing<KEYS, POINTS>),
        points: &[SurfacePoint],
        predicted: &Prediction,
    ) -> Option<ContourMatch> {
        let found = align(points, self.around(map, keys, &predicted.pose), predicted)?;
        let nearest = |point: &SurfacePoint, reach: f32| self.nearest(map, point, reach).map(|(point, _)| point);
        let found = settle(points, &self.submap, &predicted.pose, &found, nearest).unwrap_or(found);
        let share = self.share_of_overlay(map, points, &found.pose);
        let newest = keys.newest().map_or([0.0; 2], |key| key.deviation);
        Some(ContourMatch { of_overlay: newest.map(|deviation| share * deviation), ..found })
    }

    /// Learns what of a scan, whose points were seen from a pose that is known that well (m and rad), is not of `map`, over which `keys`
    /// lie, if it was taken far enough from the last one.
    pub fn learn<const KEYS: usize, const POINTS: usize>(
        &mut self,
        (map, keys): (&KeptMap, &mut KeyRing<KEYS, POINTS>),
        points: &[SurfacePoint],
        (pose, deviation): (&Pose, [f32; 2]),
    ) {
        if self.place.is_none() || !keys.wants(pose) {
            return;
        }
        let transform = Transform::of(&self.submap.origin().between(pose));
        let is_mapped = |point: &SurfacePoint| {
            let moved = point.moved(&transform);
            !Submap::<ROOM>::reaches(&moved.position)
                || self.nearest(map, &moved, LARGEST_REACH).is_some_and(|(_, is_over)| !is_over)
        };
        let unmapped = || points.iter().filter(|point| !is_mapped(point)).copied();
        if unmapped().count() < WORTH_A_KEY {
            return;
        }
        keys.keep(pose, deviation, unmapped());
        self.learnt = self.learnt.saturating_add(1);
        if self.learnt >= KEYS {
            // What has been forgotten is to go.
            self.load_anew();
        } else if let Some(key) = keys.newest() {
            self.submap.add(pose, key.points.iter());
        }
    }

    /// Share of points, seen from a pose, that lie on the overlay alone.
    fn share_of_overlay(&self, map: &KeptMap, points: &[SurfacePoint], pose: &Pose) -> f32 {
        if !self.submap.has_overlay() {
            return 0.0;
        }
        let transform = Transform::of(&self.submap.origin().between(pose));
        let near = points.iter().filter_map(|point| self.nearest(map, &point.moved(&transform), LARGEST_REACH));
        let (count, over) = near.fold((0_u16, 0_u16), |(count, over), (_, is_over)| {
            (count.saturating_add(1), over.saturating_add(u16::from(is_over)))
        });
        f32::from(over) / f32::from(count.max(1))
    }

    /// The nearest point of the same kind, and whether it is of the overlay: that goes behind the map, loaded or cut for want of room.
    fn nearest(&self, map: &KeptMap, point: &SurfacePoint, reach: f32) -> Option<(SurfacePoint, bool)> {
        let loaded = self.submap.nearest_of_either(point, reach);
        let is_of_map = loaded.is_some_and(|(_, is_over)| !is_over);
        let place = self.place.filter(|_| !is_of_map && !self.submap.holds(&point.position));
        let cut = place.and_then(|place| map.nearest(place, point, reach).0);
        cut.map(|point| (point, false)).or(loaded)
    }

    /// The surfaces of the map around a pose, with key scans over it.
    pub fn around<const KEYS: usize, const POINTS: usize>(
        &mut self,
        map: &KeptMap,
        keys: &KeyRing<KEYS, POINTS>,
        pose: &Pose,
    ) -> &Submap<ROOM> {
        let from = self.submap.origin();
        let reach = 0.5 * TILE + OUTSIDE;
        let is_inside = libm::fabs(pose.x - from.x) < reach && libm::fabs(pose.y - from.y) < reach;
        let wanted = Tile::place_of(pose.x, pose.y);
        if (self.place.is_none() || !is_inside)
            && let Some(place) = wanted
        {
            map.load(place, ROOM - ROOM / OF_OVERLAY, &mut self.submap);
            self.submap.begin_overlay();
            for key in keys.iter() {
                self.submap.add(&key.pose, key.points.iter());
            }
            self.place = wanted;
            self.learnt = 0;
        }
        &self.submap
    }
}
