//! Which of many stored places a scan is of, decided by alignment.
//!
//! The images say which places may be meant; the best of them are aligned, and the greatest agreement decides. What is
//! believed is learnt from the map alone: no two of its places that lie apart may be taken for one another. Where another
//! place agrees nearly as well, the answer is that it is one of them.

use std::vec::Vec;

use super::image::Likeness;
use super::{Alignment, Asked, Panorama, PlaceImage, Pose, SECTORS, Stored};

/// Places that are aligned.
const CANDIDATES: usize = 10;
/// Places this far apart are different ones, m; aligned poses of one spot are nearer than the second, m.
const APART: f32 = 6.0;
const SAME_SPOT: f32 = 1.5;
/// Another pose whose score is less than this behind the best makes the answer ambiguous.
const GAP: f32 = 0.08;

/// A stored place.
#[derive(Clone, Debug)]
pub struct Place {
    /// Where the scan was made, in the map.
    pub pose: Pose,
    /// From above.
    pub image: PlaceImage,
    /// From where the sensor stood.
    pub panorama: Panorama,
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
    /// Whether the score is above the limit that the map teaches.
    pub is_believed: bool,
    /// Whether another pose agrees nearly as well.
    pub is_ambiguous: bool,
}

/// Stored places, ready to be asked.
pub struct PlaceIndex<'a> {
    places: &'a [Place],
    stored: Vec<Stored<'a>>,
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

impl Pose {
    /// This pose, given in the frame of another one, in that one's own frame.
    #[must_use]
    pub fn within(&self, frame: &Self) -> Self {
        let [x, y, _] = frame.of([self.place[0], self.place[1], 0.0]);
        Self { place: [x, y], heading: frame.heading + self.heading }
    }

    /// Distance between two poses, m.
    #[must_use]
    pub fn apart(&self, other: &Self) -> f32 {
        libm::hypotf(self.place[0] - other.place[0], self.place[1] - other.place[1])
    }
}

impl<'a> PlaceIndex<'a> {
    /// Of places that lie at most `reach` from where scans are to be recognised, m. Learns what to believe: takes as long as
    /// ten alignments a place.
    #[must_use]
    pub fn new(places: &'a [Place], reach: f32) -> Self {
        let stored = places.iter().map(|place| Stored::new(&place.panorama)).collect();
        let mut index = Self { places, stored, reach, limit: 0.0 };
        index.limit = index.learnt_limit();
        index
    }

    /// The score from which answers are believed: the greatest of a place of the map with another one that lies apart. Pairs
    /// that are aligned to the very spot where both lie see the same things rightly, and teach nothing.
    fn learnt_limit(&self) -> f32 {
        let mut limit = 0.0_f32;
        for place in self.places {
            let points = place.panorama.points();
            let scan = Asked::new(&place.panorama, points);
            let others = self.alike(&place.image, |other| other.pose.apart(&place.pose) > APART);
            for (likeness, number) in others {
                let Some(found) = self.aligned(number, &likeness, &scan) else { continue };
                let pose = found.pose.within(&self.places[number].pose);
                if pose.apart(&place.pose) > SAME_SPOT {
                    limit = limit.max(found.score);
                }
            }
        }
        limit
    }

    /// The score from which answers are believed.
    #[must_use]
    pub fn limit(&self) -> f32 {
        self.limit
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
            is_believed: best.0.score > self.limit,
            is_ambiguous: found.iter().skip(1).any(|other| is_rival(&other)),
        })
    }

    /// The places whose images are most alike, of those that are wanted, best first.
    fn alike(&self, image: &PlaceImage, is_wanted: impl Fn(&Place) -> bool) -> Vec<(Likeness, usize)> {
        let wanted = self.places.iter().enumerate().filter(|(_, place)| is_wanted(place));
        let mut alike: Vec<_> =
            wanted.filter_map(|(number, place)| Some((place.image.likeness(image)?, number))).collect();
        alike.sort_by(|a, b| a.0.distance.total_cmp(&b.0.distance));
        alike.truncate(CANDIDATES);
        alike
    }

    fn aligned(&self, number: usize, likeness: &Likeness, scan: &Asked<'_>) -> Option<Alignment> {
        let headings = likeness.turns.map(|turn| -(turn as f32) * core::f32::consts::TAU / SECTORS as f32);
        let found = self.stored.get(number)?.align(scan, &headings, self.reach)?;
        (libm::hypotf(found.pose.place[0], found.pose.place[1]) <= self.reach).then_some(found)
    }
}
