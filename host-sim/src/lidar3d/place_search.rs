//! Which stored place a scan is of, and where: the best ten by their images are aligned.

use std::collections::VecDeque;

use agv_lidar3d::cloud::Cloud;
use agv_lidar3d::place::{Agreement, Asked, Earlier, Place, PlaceIndex, Pose, Query, Stored};

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
        self.find_of(&self.seen(cloud), &[])
    }

    /// The same of the next scan of a drive, which those before it help to tell.
    #[must_use]
    pub fn find_next(&self, cloud: &Cloud<'_>, sequence: &mut Sequence) -> Option<FoundPlace> {
        let seen = self.seen(cloud);
        if sequence.length == 0 {
            return self.find_of(&seen, &[]);
        }
        sequence.move_on(&seen);
        let earlier: Vec<Earlier<'_>> =
            sequence.kept.iter().map(|(earlier, pose)| Earlier { scan: earlier.asked(), pose: *pose }).collect();
        let found = self.find_of(&seen, &earlier);
        drop(earlier);
        sequence.last = Some(seen);
        found
    }

    fn seen(&self, cloud: &Cloud<'_>) -> Seen {
        let floor = self.map.standing.floor(cloud);
        let points = cloud.seen().map(|point| floor.levelled(point)).collect();
        Seen { view: View::new(cloud, &floor, self.map.span), points }
    }

    fn find_of(&self, seen: &Seen, earlier: &[Earlier<'_>]) -> Option<FoundPlace> {
        let answer = self.index.find(&Query { image: &seen.view.image, scan: seen.asked(), earlier })?;
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

/// A scan that was taken.
struct Seen {
    view: View,
    /// Levelled.
    points: Vec<[f32; 3]>,
}

impl Seen {
    fn asked(&self) -> Asked<'_> {
        Asked::new(&self.view.panorama, self.points.iter().copied())
    }
}

/// Scans of a drive that lie at least a metre apart, and where they were taken: each is aligned to the one before.
pub struct Sequence {
    /// Scans that are kept at the most.
    length: usize,
    /// Newest first, with their poses in the frame of the last scan.
    kept: VecDeque<(Seen, Pose)>,
    last: Option<Seen>,
}

/// Scans of a sequence lie so far apart, m; from nearer ones the same is seen.
const SPACING: f32 = 1.0;
/// How far the sensor moves between two scans at the most, m.
const STEP: f32 = 4.0;
/// Two scans of one drive agree by so much where they are laid onto each other rightly.
const AGREED: f32 = 0.5;

impl Sequence {
    /// None yet; helps with so many scans besides the newest.
    #[must_use]
    pub fn new(length: usize) -> Self {
        Self { length, kept: VecDeque::with_capacity(length + 1), last: None }
    }

    /// Poses in the frame of the next scan. Where it cannot be laid onto the last one, nothing is known of those before.
    fn move_on(&mut self, next: &Seen) {
        let Some(last) = self.last.take() else { return };
        let Some(moved) = motion(&last, next) else {
            self.kept.clear();
            return;
        };
        // Of the last scan, seen from the next one.
        let back = Pose { place: [0.0, 0.0], heading: 0.0 }.seen_from(&moved);
        for (_, pose) in &mut self.kept {
            *pose = pose.within(&back);
        }
        if self.kept.front().is_none_or(|(_, newest)| newest.apart(&back) >= SPACING) {
            self.kept.push_front((last, back));
            self.kept.truncate(self.length);
        }
    }
}

/// Where a scan was taken, seen from the one before; None if they do not fit.
fn motion(last: &Seen, next: &Seen) -> Option<Pose> {
    let [one, other] = last.view.image.likeness(&next.view.image)?.headings();
    let headings = [0.0, one, other];
    let found = Stored::new(&last.view.panorama).align(&next.asked(), &headings, STEP)?;
    (found.agreement.score > AGREED).then_some(found.pose)
}
