//! Which of many stored places a scan is of, decided by alignment.
//!
//! The images say which places may be meant; the best of them are aligned, and the greatest agreement decides. What is
//! believed is learnt from the map alone: no two of its places that lie apart may be taken for one another. Where another
//! place agrees nearly as well, the answer is that it is one of them.

use std::vec::Vec;

use super::image::Likeness;
use super::{Alignment, Asked, AskedImage, Panorama, PlaceImage, Pose, RingKey, SECTORS, Stored};

/// Places that are aligned.
const CANDIDATES: usize = 10;
/// Places whose images are compared at the most: those whose keys are nearest.
const COMPARED: usize = 4000;
/// Places from which the limit is learnt at the most, and the share of them that may look more alike to others than it: these
/// have limits of their own.
const LEARNING: usize = 512;
const ALIKE: f32 = 0.03;
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
    /// Number of the place.
    pub place: usize,
    /// The sensor's pose in the map.
    pub pose: Pose,
    /// Part of the floor plan that agrees, 0 to 1.
    pub score: f32,
    /// Whether the score is above the limit that the map teaches, and above all that the place has with others of the map.
    pub is_believed: bool,
    /// Whether another pose agrees nearly as well.
    pub is_ambiguous: bool,
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
}

impl<'a> PlaceIndex<'a> {
    /// Of places that lie at most `reach` from where scans are to be recognised, m. Believes every answer.
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

    /// Learns from which score on answers are believed, but for places that look more alike to others: from 512 places at the most, as long as ten alignments take for each. `progress` is called after each with
    /// how many there are.
    #[must_use]
    pub fn learnt_limit(&self, mut progress: impl FnMut(usize)) -> f32 {
        let step = self.places.len().div_ceil(LEARNING).max(1);
        let count = self.places.len().div_ceil(step);
        let learnt = self.places.iter().step_by(step).map(|place| {
            progress(count);
            self.look_alike(place)
        });
        let mut scores: Vec<f32> = learnt.collect();
        scores.sort_by(|a, b| b.total_cmp(a));
        scores.get((ALIKE * scores.len() as f32) as usize).copied().unwrap_or(0.0)
    }

    /// The greatest score of a place with another one of the map that lies apart. Pairs that are aligned to the very spot where
    /// both lie see the same things rightly, and teach nothing.
    fn look_alike(&self, place: &Place<'_>) -> f32 {
        let scan = Asked::new(place.panorama, place.panorama.points());
        let others = self.alike(place.image, |other| other.pose.apart(&place.pose) > APART);
        let score = |(likeness, number): (Likeness, usize)| {
            let found = self.aligned(number, &likeness, &scan)?;
            let pose = found.pose.within(&self.places.get(number)?.pose);
            (pose.apart(&place.pose) > SAME_SPOT).then_some(found.score)
        };
        others.into_iter().filter_map(score).fold(0.0, f32::max)
    }

    /// The places whose images are most alike to one, best first: those that are aligned.
    #[must_use]
    pub fn candidates(&self, image: &PlaceImage) -> Vec<usize> {
        self.alike(image, |_| true).into_iter().map(|(_, number)| number).collect()
    }

    /// The place that a scan is of; None if no place is like it.
    #[must_use]
    pub fn find(&self, query: &Query<'_>) -> Option<Answer> {
        let mut found: Vec<(Alignment, usize)> = self
            .alike(query.image, |_| true)
            .into_iter()
            .filter_map(|(likeness, number)| Some((self.aligned(number, &likeness, &query.scan)?, number)))
            .collect();
        found.sort_by(|a, b| b.0.score.total_cmp(&a.0.score));
        let in_map = |(found, number): &(Alignment, usize)| found.pose.within(&self.places[*number].pose);
        let best = found.first()?;
        let pose = in_map(best);
        let is_rival =
            |other: &&(Alignment, usize)| in_map(other).apart(&pose) > SAME_SPOT && other.0.score > best.0.score - GAP;
        Some(Answer {
            place: best.1,
            pose,
            score: best.0.score,
            is_believed: best.0.score > self.limit && best.0.score > self.look_alike(self.places.get(best.1)?),
            is_ambiguous: found.iter().skip(1).any(|other| is_rival(&other)),
        })
    }

    /// The places whose images are most alike, of those that are wanted, best first.
    fn alike(&self, image: &PlaceImage, is_wanted: impl Fn(&Place<'_>) -> bool) -> Vec<(Likeness, usize)> {
        let asked = AskedImage::new(image);
        let compare = |number: usize| {
            let place = self.places.get(number).filter(|place| is_wanted(place))?;
            Some((asked.likeness(place.image)?, number))
        };
        let mut alike: Vec<_> = self.near(&RingKey::new(image)).into_iter().filter_map(compare).collect();
        alike.sort_by(|a, b| a.0.distance.total_cmp(&b.0.distance));
        alike.truncate(CANDIDATES);
        alike
    }

    /// The places whose keys are nearest.
    fn near(&self, asked: &RingKey) -> Vec<usize> {
        let mut numbers: Vec<usize> = (0..self.places.len()).collect();
        if numbers.len() > COMPARED {
            let distances: Vec<u32> = self.keys.iter().map(|key| key.square_distance(asked)).collect();
            numbers.select_nth_unstable_by_key(COMPARED, |number| distances.get(*number).copied());
            numbers.truncate(COMPARED);
        }
        numbers
    }

    fn aligned(&self, number: usize, likeness: &Likeness, scan: &Asked<'_>) -> Option<Alignment> {
        let headings = likeness.turns.map(|turn| -(turn as f32) * core::f32::consts::TAU / SECTORS as f32);
        let found = Stored::new(self.places.get(number)?.panorama).align(scan, &headings, self.reach)?;
        (libm::hypotf(found.pose.place[0], found.pose.place[1]) <= self.reach).then_some(found)
    }
}
