//! The external dynamic map of K 5.4.1: landmarks that appear, are confirmed and disappear while the vehicle drives.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::LandmarkKind;
use crate::geometry::Point;

/// How the dynamic map lives.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DynamicMapParameters {
    /// Share of a new observation in the position of its landmark, 0 to 1 (Algorithm 1: ur).
    pub update_rate: f64,
    /// Hit count of a landmark that is new.
    pub first_hits: u16,
    /// Hit counts grow no further than this.
    pub most_hits: u16,
    /// A landmark corrects the pose only from this hit count on.
    pub least_hits: u16,
    /// Standard deviation that is assumed for the position of a landmark along each axis, m: the map of Algorithm 1
    /// carries none.
    pub deviation: f64,
}

impl Default for DynamicMapParameters {
    /// Update rate of K 5.6; a landmark counts as long as it exists, as Algorithm 1 has it.
    fn default() -> Self {
        Self { update_rate: 0.1, first_hits: 1, most_hits: u16::MAX, least_hits: 0, deviation: 0.0 }
    }
}

/// A landmark of the dynamic map.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DynamicLandmark {
    /// Name, not used again before 65,536 others.
    pub id: u16,
    /// What it is.
    pub kind: LandmarkKind,
    /// Position in W, m.
    pub position: Point,
    /// How often it was seen more than missed.
    pub hits: u16,
    was_updated: bool,
}

/// Up to `LANDMARKS` landmarks, updated by Algorithm 1 of K.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct DynamicMap<const LANDMARKS: usize> {
    parameters: DynamicMapParameters,
    landmarks: Vec<DynamicLandmark, LANDMARKS>,
    next_id: u16,
}

/// A [`DynamicMap`] of any capacity.
#[derive(Clone, Copy, Debug)]
pub struct DynamicMapView<'a> {
    landmarks: &'a [DynamicLandmark],
    least_hits: u16,
}

impl<'a> DynamicMapView<'a> {
    /// The landmarks within `radius` (m) of `point` that have been seen often enough to count.
    #[inline]
    pub fn near(self, point: Point, radius: f64) -> impl Iterator<Item = &'a DynamicLandmark> {
        self.landmarks.iter().filter(move |landmark| {
            landmark.hits >= self.least_hits
                && libm::hypot(landmark.position.x - point.x, landmark.position.y - point.y) <= radius
        })
    }
}

impl<const LANDMARKS: usize> DynamicMap<LANDMARKS> {
    /// An empty map.
    #[must_use]
    pub const fn new(parameters: DynamicMapParameters) -> Self {
        Self { parameters, landmarks: Vec::new(), next_id: 0 }
    }

    /// All landmarks, those too that do not count yet.
    #[must_use]
    pub fn landmarks(&self) -> &[DynamicLandmark] {
        &self.landmarks
    }

    /// The map without its capacity.
    #[must_use]
    #[inline]
    pub fn view(&self) -> DynamicMapView<'_> {
        DynamicMapView { landmarks: &self.landmarks, least_hits: self.parameters.least_hits }
    }

    /// See [`DynamicMapView::near`].
    pub fn near(&self, point: Point, radius: f64) -> impl Iterator<Item = &DynamicLandmark> {
        self.view().near(point, radius)
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.landmarks.clear();
    }

    /// Algorithm 1, lines 3 to 5: a feature at `position` (m, in W) was associated with landmark `id`.
    pub fn update(&mut self, id: u16, position: Point) {
        let parameters = self.parameters;
        if let Some(landmark) = self.landmarks.iter_mut().find(|landmark| landmark.id == id) {
            landmark.position += (position - landmark.position) * parameters.update_rate;
            landmark.hits = landmark.hits.saturating_add(1).min(parameters.most_hits);
            landmark.was_updated = true;
        }
    }

    /// Algorithm 1, line 7: a feature at `position` (m, in W) was associated with nothing. If the map is full, it takes
    /// the place of the landmark with the lowest hit count, unless all have been seen in this scan.
    pub fn insert(&mut self, kind: LandmarkKind, position: Point) {
        let new =
            DynamicLandmark { id: self.next_id, kind, position, hits: self.parameters.first_hits, was_updated: true };
        if self.landmarks.is_full() {
            let weakest = self.landmarks.iter_mut().filter(|landmark| !landmark.was_updated).min_by_key(|l| l.hits);
            let Some(weakest) = weakest else {
                return;
            };
            *weakest = new;
        } else {
            let _ = self.landmarks.push(new);
        }
        self.next_id = self.next_id.wrapping_add(1);
    }

    /// Algorithm 1, lines 10 to 18: ends a scan. Landmarks whose count is used up go; those that were not seen lose a
    /// hit.
    pub fn finish(&mut self) {
        self.landmarks.retain(|landmark| landmark.hits > 0);
        for landmark in &mut self.landmarks {
            if !landmark.was_updated {
                landmark.hits = landmark.hits.saturating_sub(1);
            }
            landmark.was_updated = false;
        }
    }
}
