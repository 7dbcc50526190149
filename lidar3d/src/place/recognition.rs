//! Which of many stored places a scan is of, decided by alignment.
//!
//! The images say which places may be meant; the best of them are aligned, and the greatest agreement decides. What is
//! believed is learnt from the map alone: no two of its places that lie apart may be taken for one another. Where another
//! place agrees nearly as well, the answer is that it is one of them.

use std::vec::Vec;

use super::agreement::{Agreement, Voters};
use super::image::Likeness;
use super::look_alikes::limit;
use super::{Alignment, Asked, AskedImage, AskedKey, Panorama, PlaceImage, Pose, RingKey, Stored};

/// Places that are aligned.
const CANDIDATES: usize = 10;
/// Places whose images are compared at the most: those whose keys are nearest.
const COMPARED: usize = 4000;
/// Places from which the limit is learnt at the most.
const LEARNING: usize = 512;
/// Other places next to a pose that are heard about it, and how far away they may be, in parts of the reach of a place.
const NEIGHBOURS: usize = 2;
const NEIGHBOURHOOD: f32 = 2.0;
/// Places this far apart are different ones, m; aligned poses of one spot are nearer than the second, m.
const APART: f32 = 6.0;
const SAME_SPOT: f32 = 1.5;
/// Another pose whose score is less than this behind the best makes the answer ambiguous.
const GAP: f32 = 0.08;

/// A stored place.
#[derive(Clone, Copy, Debug)]
pub struct Place<'a> {
    /// Where the scan was made, in the map.
    pub pose: Pose,
    /// From above.
    pub image: &'a PlaceImage,
    /// From where the sensor stood.
    pub panorama: &'a Panorama,
}

/// An answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// Number of the place that is nearest to the pose.
    pub place: usize,
    /// The sensor's pose in the map.
    pub pose: Pose,
    /// How much of the floor plan agrees: the mean of the place and of those next to the pose.
    pub agreement: Agreement,
    /// Whether what is visible agrees by more than the limit that the map teaches, and by more than it does between the place and
    /// others of the map.
    pub is_believed: bool,
    /// Whether another pose agrees nearly as well.
    pub is_ambiguous: bool,
}

/// Where a scan may have been made.
#[derive(Clone, Copy)]
struct Found {
    place: usize,
    /// In the map.
    pose: Pose,
    agreement: Agreement,
}

/// Stored places, ready to be asked.
pub struct PlaceIndex<'a> {
    places: Vec<Place<'a>>,
    keys: Vec<RingKey>,
    /// How far from a place a scan may be taken to belong to it, m.
    reach: f32,
    limit: f32,
}

/// A scan that is asked for.
pub struct Query<'a> {
    /// From above.
    pub image: &'a PlaceImage,
    /// Its points, levelled, and its panorama.
    pub scan: Asked<'a>,
    /// Scans that were made on the way to it: what they see says as well where it is. May be none.
    pub earlier: &'a [Earlier<'a>],
}

/// A scan that was made earlier.
pub struct Earlier<'a> {
    /// Its points, levelled, and its panorama.
    pub scan: Asked<'a>,
    /// Where it was made, in the frame of the one that is asked for.
    pub pose: Pose,
}

impl<'a> PlaceIndex<'a> {
    /// Of places that lie at most `reach` from where scans are to be recognised, m. Believes what agrees better than the place does with others.
    #[must_use]
    pub fn new(places: Vec<Place<'a>>, reach: f32) -> Self {
        let keys = places.iter().map(|place| RingKey::new(place.image)).collect();
        Self { places, keys, reach, limit: 0.0 }
    }

    /// The same, with a limit that was learnt before.
    #[must_use]
    pub fn with_limit(self, limit: f32) -> Self {
        Self { limit, ..self }
    }

    /// Learns from which agreement of what is visible on answers are believed, from 512 places at the most, as long as ten alignments
    /// take for each. `progress` is called before each with how many there are.
    #[must_use]
    pub fn learnt_limit(&self, mut progress: impl FnMut(usize)) -> f32 {
        let step = self.places.len().div_ceil(LEARNING).max(1);
        let count = self.places.len().div_ceil(step);
        let (mut alike, mut same) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for (number, place) in self.places.iter().enumerate().step_by(step) {
            progress(count);
            let scan = Asked::new(place.panorama, place.panorama.points());
            alike.extend(best(&self.look_alikes(place, &scan)).map(|found| found.agreement.visible));
            let next = self.agreements(&place.pose, Some(number), Some(place), &scan);
            same.extend((!next.is_empty()).then(|| Agreement::mean(next.into_iter()).visible));
        }
        limit(alike, same)
    }

    /// Where a place may be taken to lie among others of the map. Pairs that are aligned to the very spot where both lie see the same
    /// things rightly, and teach nothing.
    fn look_alikes(&self, place: &Place<'_>, scan: &Asked<'_>) -> Vec<Found> {
        let found = self.found(place.image, scan, &[], Some(place)).into_iter();
        found.filter(|found| found.pose.apart(&place.pose) > SAME_SPOT).collect()
    }

    /// The places whose images are most alike to one, best first: those that are aligned.
    #[must_use]
    pub fn candidates(&self, image: &PlaceImage) -> Vec<usize> {
        self.alike(image, |_| true).into_iter().map(|(_, number)| number).collect()
    }

    /// The place that a scan is of; None if no place is like it.
    #[must_use]
    pub fn find(&self, query: &Query<'_>) -> Option<Answer> {
        let found = self.found(query.image, &query.scan, query.earlier, None);
        let best = best(&found)?;
        let place = self.places.get(best.place)?;
        let look_alikes = self.look_alikes(place, &Asked::new(place.panorama, place.panorama.points()));
        let look_alike = look_alikes.iter().map(|found| found.agreement.visible).fold(0.0, f32::max);
        let is_rival = |other: &Found| {
            other.pose.apart(&best.pose) > SAME_SPOT && other.agreement.score > best.agreement.score - GAP
        };
        Some(Answer {
            place: self.nearest(&best.pose, 1, |_, _| true).first().map_or(best.place, |(number, _)| *number),
            pose: best.pose,
            agreement: best.agreement,
            is_believed: best.agreement.visible > self.limit.max(look_alike),
            is_ambiguous: found.iter().any(is_rival),
        })
    }

    /// Where a scan may have been made: aligned to the places most alike. If it is that of a place of the map, only those count
    /// that lie apart from it.
    fn found(
        &self,
        image: &PlaceImage,
        scan: &Asked<'_>,
        earlier: &[Earlier<'_>],
        own: Option<&Place<'_>>,
    ) -> Vec<Found> {
        let is_apart = |other: &Place<'_>| own.is_none_or(|own| are_apart(other, own));
        let found = |(likeness, number): (Likeness, usize)| {
            let aligned = self.aligned(number, &likeness, scan)?;
            let pose = aligned.pose.within(&self.places.get(number)?.pose);
            let others = self.agreements(&pose, Some(number), own, scan);
            let before = earlier
                .iter()
                .flat_map(|earlier| self.agreements(&earlier.pose.within(&pose), None, None, &earlier.scan));
            let agreement = Agreement::mean(core::iter::once(aligned.agreement).chain(others).chain(before));
            Some(Found { place: number, pose, agreement })
        };
        self.alike(image, is_apart).into_iter().filter_map(found).collect()
    }

    /// How much a scan at a pose agrees with the places next to it, but for one that it is aligned to and the asked one. They see the
    /// same things from elsewhere: where a scan is of another place that looks the same, they agree less.
    fn agreements(
        &self,
        pose: &Pose,
        aligned: Option<usize>,
        own: Option<&Place<'_>>,
        scan: &Asked<'_>,
    ) -> Vec<Agreement> {
        let is_other = |number: usize, place: &Place<'_>| {
            Some(number) != aligned && own.is_none_or(|own| !core::ptr::eq(own.panorama, place.panorama))
        };
        let agreement = |(_, place): (usize, &Place<'_>)| {
            Voters::of(place.panorama).agreement(&scan.voters, &pose.seen_from(&place.pose))
        };
        self.nearest(pose, NEIGHBOURS, is_other).into_iter().map(agreement).collect()
    }

    /// So many places next to a pose, nearest first, of those in its neighbourhood that are wanted.
    fn nearest(
        &self,
        pose: &Pose,
        count: usize,
        is_wanted: impl Fn(usize, &Place<'_>) -> bool,
    ) -> Vec<(usize, &Place<'a>)> {
        let apart = |place: &Place<'_>| place.pose.apart(pose);
        let mut next: Vec<(usize, &Place<'a>)> = Vec::with_capacity(count + 1);
        for (number, place) in self.places.iter().enumerate() {
            let is_nearer = next.len() < count || next.last().is_some_and(|(_, last)| apart(place) < apart(last));
            if apart(place) <= NEIGHBOURHOOD * self.reach && is_nearer && is_wanted(number, place) {
                let at = next.partition_point(|(_, other)| apart(other) <= apart(place));
                next.insert(at, (number, place));
                next.truncate(count);
            }
        }
        next
    }

    /// The places whose images are most alike, of those that are wanted, best first.
    fn alike(&self, image: &PlaceImage, is_wanted: impl Fn(&Place<'_>) -> bool) -> Vec<(Likeness, usize)> {
        let asked = AskedImage::new(image);
        let compare = |number: usize| {
            let place = self.places.get(number).filter(|place| is_wanted(place))?;
            Some((asked.likeness(place.image)?, number))
        };
        let mut alike: Vec<_> = self.near(&AskedKey::new(image)).into_iter().filter_map(compare).collect();
        alike.sort_by(|a, b| a.0.distance.total_cmp(&b.0.distance));
        alike.truncate(CANDIDATES);
        alike
    }

    /// The places whose keys are nearest.
    fn near(&self, asked: &AskedKey) -> Vec<usize> {
        let mut numbers: Vec<usize> = (0..self.places.len()).collect();
        if numbers.len() > COMPARED {
            let distances: Vec<f32> = self.keys.iter().map(|key| asked.square_distance(key)).collect();
            let distance = |number: &usize| distances.get(*number).copied().unwrap_or(f32::MAX);
            numbers.select_nth_unstable_by(COMPARED, |a, b| distance(a).total_cmp(&distance(b)));
            numbers.truncate(COMPARED);
        }
        numbers
    }

    fn aligned(&self, number: usize, likeness: &Likeness, scan: &Asked<'_>) -> Option<Alignment> {
        let found = Stored::new(self.places.get(number)?.panorama).align(scan, &likeness.headings(), self.reach)?;
        (libm::hypotf(found.pose.place[0], found.pose.place[1]) <= self.reach).then_some(found)
    }
}

/// Whether two places are different ones.
fn are_apart(one: &Place<'_>, other: &Place<'_>) -> bool {
    one.pose.apart(&other.pose) > APART
}

fn best(found: &[Found]) -> Option<&Found> {
    found.iter().max_by(|a, b| a.agreement.score.total_cmp(&b.agreement.score))
}
