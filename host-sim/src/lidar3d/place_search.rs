//! Which stored place a scan is of, and where: the best ten by their images are aligned.

use agv_lidar3d::cloud::Cloud;
use agv_lidar3d::place::{Agreement, Asked, Place, PlaceIndex, Pose, Query};

use super::place_map::PlaceMap;
use super::view::View;

/// Scans are recognised this far from a place, m, and by this share of the distance between places, whatever is more.
const REACH: f64 = 3.0;
const REACH_SHARE: f64 = 0.6;

/// Stored places with poses, ready to be asked.
pub struct PlaceSearch<'a> {
    map: &'a PlaceMap,
    index: PlaceIndex<'a>,
    /// Of the poses of the index, m.
    origin: [f64; 2],
}

/// A place that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoundPlace {
    /// Number of the place.
    pub place: usize,
    /// x, y (m) and heading (rad) of the sensor.
    pub pose: [f64; 3],
    /// How much of the floor plan agrees.
    pub agreement: Agreement,
    /// Whether of what is visible more agrees than the map has taught that different places have in common.
    pub is_believed: bool,
    /// Whether another place agrees nearly as well.
    pub is_ambiguous: bool,
}

impl<'a> PlaceSearch<'a> {
    /// Of a map; None if the poses of its places are not known.
    #[must_use]
    pub fn new(map: &'a PlaceMap) -> Option<Self> {
        let [x0, y0, _] = map.places.first()?.pose?;
        let place = |place: &'a super::place_map::StoredPlace| {
            let [x, y, heading] = place.pose?;
            let pose = Pose { place: [(x - x0) as f32, (y - y0) as f32], heading: heading as f32 };
            Some(Place { pose, image: &place.view.image, panorama: &place.view.panorama })
        };
        let places: Vec<Place<'a>> = map.places.iter().map(place).collect::<Option<_>>()?;
        let reach = REACH.max(REACH_SHARE * map.spacing().unwrap_or(0.0));
        let index = PlaceIndex::new(places, reach as f32).with_limit(map.limit.unwrap_or(0.0));
        Some(Self { map, index, origin: [x0, y0] })
    }

    /// Learns from which agreement on answers are believed; see [`PlaceIndex::learnt_limit`].
    #[must_use]
    pub fn learnt_limit(&self, progress: impl FnMut(usize)) -> f32 {
        self.index.learnt_limit(progress)
    }

    /// Where a scan was taken; None if no place is like it.
    #[must_use]
    pub fn find(&self, cloud: &Cloud<'_>) -> Option<FoundPlace> {
        let floor = self.map.standing.floor(cloud);
        let view = View::new(cloud, &floor, self.map.span);
        let points = cloud.seen().map(|point| floor.levelled(point));
        let scan = Asked::new(&view.panorama, points);
        let answer = self.index.find(&Query { image: &view.image, scan })?;
        let [x, y] = answer.pose.place.map(f64::from);
        Some(FoundPlace {
            place: answer.place,
            pose: [self.origin[0] + x, self.origin[1] + y, f64::from(answer.pose.heading)],
            agreement: answer.agreement,
            is_believed: answer.is_believed,
            is_ambiguous: answer.is_ambiguous,
        })
    }
}
