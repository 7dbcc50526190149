//! Places where scan and map agree, and what they come to.

use heapless::Vec;
use nalgebra::Matrix3;

use crate::geometry::{Pose, ScanPoint, difference};
use crate::order::insertion_sort_by;

/// Where a scan may have been taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaceFix {
    /// Pose of the frame of the scan's points in that of the map.
    pub pose: Pose,
    /// Inverse of its covariance (x, y, theta) if points err independently.
    pub information: Matrix3<f64>,
    /// Share of the scan's points that lie on surfaces of the map.
    pub share: f32,
    /// Share of the surfaces of the map that should be in sight and that the scan shows.
    pub shown: f32,
    /// The unit vector along which the surfaces do not say where it is.
    pub free_axis: Option<ScanPoint>,
}

impl PlaceFix {
    /// How well scan and map agree there, from 0 to 1.
    #[must_use]
    pub fn overlap(&self) -> f32 {
        self.share * self.shown
    }

    /// Whether another pose is about the same place.
    fn is_same(&self, other: &Pose) -> bool {
        let apart = self.pose.position() - other.position();
        apart.norm() < SAME.0 && libm::fabs(difference(self.pose.theta, other.theta)) < SAME.1
    }
}

/// What a search ends in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlaceAnswer {
    /// Scan and map agree at one place, and nowhere else nearly as well.
    Found(PlaceFix),
    /// They agree at two places, or all along a corridor.
    Ambiguous(PlaceFix, PlaceFix),
    /// Too few surfaces are seen to tell.
    TooFew,
    /// They agree nowhere.
    Unknown,
}

/// Poses closer than this are one place, m and rad.
const SAME: (f64, f64) = (0.3, 0.1);

/// A place is as good as the best one if they agree there this much as well,
const AS_GOOD: f32 = 0.9;

/// and less so by this much of what does not agree at the best one: things that were moved may speak for a wrong place, too.
const BY_DISAGREEING: f32 = 0.3;

/// Places that are looked at closely.
const CANDIDATES: usize = 4;

/// Two places of a corridor, for whoever asks: along its axis, m.
const ALONG: f64 = 1.0;

/// What separate things say of a place.
#[derive(Clone, Copy, Debug)]
pub(super) enum Held {
    /// They hold it.
    Surely,
    /// Some say that it is here.
    Disputed(Pose),
    /// Too few hold it.
    ByTooFew,
}

/// One of the best places.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub fix: PlaceFix,
    pub held: Held,
}

/// The best places, the best first.
#[derive(Clone, Debug)]
pub(super) struct BestPlaces {
    places: Vec<Candidate, CANDIDATES>,
}

impl BestPlaces {
    #[inline(always)]
    pub(super) const fn new() -> Self {
        Self { places: Vec::new() }
    }

    pub(super) fn clear(&mut self) {
        self.places.clear();
    }

    pub(super) fn get(&self, place: usize) -> Option<&Candidate> {
        self.places.get(place)
    }

    pub(super) fn get_mut(&mut self, place: usize) -> Option<&mut Candidate> {
        self.places.get_mut(place)
    }

    /// Keeps the best that are not the same place.
    pub(super) fn keep(&mut self, fix: PlaceFix) {
        let candidate = Candidate { fix, held: Held::ByTooFew };
        if let Some(same) = self.places.iter_mut().find(|other| other.fix.is_same(&fix.pose)) {
            if fix.overlap() > same.fix.overlap() {
                *same = candidate;
            }
        } else if self.places.push(candidate).is_err()
            && let Some(last) = self.places.last_mut().filter(|last| fix.overlap() > last.fix.overlap())
        {
            *last = candidate;
        }
        insertion_sort_by(&mut self.places, |one, other| other.fix.overlap().total_cmp(&one.fix.overlap()));
    }

    /// What they come to; `is_crowded` if there are places as good that were not looked at.
    pub(super) fn answer(&mut self, is_crowded: bool) -> PlaceAnswer {
        insertion_sort_by(&mut self.places, |one, other| other.fix.overlap().total_cmp(&one.fix.overlap()));
        let Some((Candidate { fix: best, held }, others)) = self.places.split_first() else {
            return PlaceAnswer::Unknown;
        };
        let as_good = (AS_GOOD - BY_DISAGREEING * (1.0 - best.overlap())) * best.overlap();
        let is_second = |other: &&Candidate| !best.is_same(&other.fix.pose) && other.fix.overlap() >= as_good;
        let at = |pose: Pose| PlaceFix { pose, ..*best };
        match (others.iter().find(is_second), best.free_axis, held) {
            (Some(second), ..) => PlaceAnswer::Ambiguous(*best, second.fix),
            (None, Some(axis), _) => {
                let (x, y) = (best.pose.x + ALONG * f64::from(axis.x), best.pose.y + ALONG * f64::from(axis.y));
                PlaceAnswer::Ambiguous(*best, at(Pose { x, y, ..best.pose }))
            }
            // One that was not looked at may be as good.
            (None, None, _) if is_crowded => PlaceAnswer::Unknown,
            (None, None, Held::Surely) => PlaceAnswer::Found(*best),
            (None, None, Held::Disputed(pose)) => PlaceAnswer::Ambiguous(*best, at(*pose)),
            (None, None, Held::ByTooFew) => PlaceAnswer::Unknown,
        }
    }
}
