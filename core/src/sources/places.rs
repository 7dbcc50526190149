//! Searching a start in a map of contours, of any capacity or none.

use core::convert::Infallible;
use core::fmt::Debug;
use core::marker::PhantomData;

use super::FeatureParameters;
use crate::contours::{KeptMap, PlaceAnswer, PlaceProgress, PlaceSearch, Submap};
use crate::geometry::Pose;
use crate::measurement::Scan;
use crate::odometry::RecentMotion;
use crate::sensing::{PointScan, SensorPath};

/// Beams of a scan.
const BEAMS: usize = 1440;

/// Places along the way during a revolution.
const PATH_STEPS: u32 = 8;

/// A [`PlaceSearch`] with what it needs of a scan; the map is lent for `'m`.
#[derive(Clone, Debug)]
pub struct Places<'m, const POINTS: usize, const ROOM: usize> {
    points: PointScan<BEAMS>,
    search: PlaceSearch<POINTS>,
    lent: PhantomData<(KeptMap<'m>, Submap<ROOM>)>,
}

/// A vehicle that searches no start in a map of contours.
#[derive(Clone, Copy, Debug)]
pub struct NoPlaces;

/// [`Places`] of any capacity, or none.
pub trait FindPlaces: Clone + Debug {
    /// A map as it is lent.
    type Map: Copy + Debug;

    /// Memory for what is around a place, as it is lent.
    type Room: Debug;

    /// Whether there is anything to search with.
    const IS_THERE: bool;

    /// Nothing was seen.
    fn new() -> Self;

    /// The map has been replaced.
    fn forget_map(&mut self);

    /// Begins to search where the laser at `mount` in R was at the first beam of a scan.
    fn begin(&mut self, scan: &Scan, mount: &Pose, motion: &RecentMotion, features: &FeatureParameters);

    /// Goes on until `effort` is spent: see [`PlaceSearch::advance`].
    fn advance(&mut self, map: &Self::Map, room: &mut Self::Room, effort: u32) -> PlaceProgress;
}

impl<'m, const POINTS: usize, const ROOM: usize> FindPlaces for Places<'m, POINTS, ROOM> {
    type Map = KeptMap<'m>;
    type Room = Submap<ROOM>;

    const IS_THERE: bool = true;

    #[inline(always)]
    fn new() -> Self {
        Self { points: PointScan::new(), search: PlaceSearch::new(), lent: PhantomData }
    }

    fn forget_map(&mut self) {
        self.search.forget_map();
    }

    fn begin(&mut self, scan: &Scan, mount: &Pose, motion: &RecentMotion, features: &FeatureParameters) {
        self.points.set(scan, features.nearest, features.farthest);
        if features.motion_correction {
            let (from, duration) = (motion.pose_at(scan.start), scan.end().since(scan.start));
            let time = |step: u32| scan.start.offset(duration * f64::from(step) / f64::from(PATH_STEPS));
            let displacements = (0..=PATH_STEPS).map(|step| (time(step), from.between(&motion.pose_at(time(step)))));
            let mut path = SensorPath::default();
            path.set(scan.start, mount, displacements);
            path.correct(scan, &mut self.points);
        }
        self.search.begin(self.points.view());
    }

    fn advance(&mut self, map: &KeptMap<'m>, room: &mut Submap<ROOM>, effort: u32) -> PlaceProgress {
        self.search.advance(map, room, effort)
    }
}

impl FindPlaces for NoPlaces {
    type Map = Infallible;
    type Room = Infallible;

    const IS_THERE: bool = false;

    fn new() -> Self {
        Self
    }

    fn forget_map(&mut self) {}

    fn begin(&mut self, _: &Scan, _: &Pose, _: &RecentMotion, _: &FeatureParameters) {}

    fn advance(&mut self, _: &Infallible, _: &mut Infallible, _: u32) -> PlaceProgress {
        PlaceProgress::Done(PlaceAnswer::Unknown)
    }
}
