//! What is known of the landmarks in the state beside their positions.

use serde::{Deserialize, Serialize};

use crate::filter::{Slots, Storage, storage};
use crate::geometry::difference;
use crate::maps::LandmarkKind;
use crate::state::LandmarkSource;

use super::slot_parameters::SlamParameters;

/// A landmark in the state.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Slot {
    pub source: LandmarkSource,
    pub id: u16,
    pub kind: LandmarkKind,
    /// Direction in W, rad.
    pub orientation: f32,
    hits: u16,
    /// Scans since it was seen.
    unseen: u16,
}

/// One for each landmark's slot of the state.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(bound = "")]
pub(crate) struct LandmarkSlots<S: Slots> {
    #[serde(with = "storage")]
    slots: S::PerLandmark<Option<Slot>>,
    next_id: u16,
}

impl<S: Slots> LandmarkSlots<S> {
    #[inline(always)]
    pub(crate) fn new() -> Self {
        Self { slots: S::PerLandmark::empty(), next_id: 0 }
    }

    pub(crate) fn clear(&mut self) {
        self.slots.as_mut().fill(None);
    }

    /// Forgets the landmarks that were given; `remove` is called with their slots.
    pub(crate) fn forget_given(&mut self, mut remove: impl FnMut(usize)) {
        for (slot, landmark) in self.slots.as_mut().iter_mut().enumerate() {
            if landmark.take_if(|landmark| landmark.source == LandmarkSource::Fixed).is_some() {
                remove(slot);
            }
        }
    }

    /// The landmarks with their slots.
    pub(crate) fn occupied(&self) -> impl Iterator<Item = (usize, &Slot)> {
        self.slots.as_ref().iter().enumerate().filter_map(|(slot, landmark)| Some((slot, landmark.as_ref()?)))
    }

    pub(crate) fn has_fixed(&self, id: u16, kind: LandmarkKind) -> bool {
        self.occupied()
            .any(|(_, landmark)| landmark.source == LandmarkSource::Fixed && landmark.id == id && landmark.kind == kind)
    }

    /// Finds a slot for a landmark: a free one, else that of the landmark that has not been seen for longest. None if all
    /// have been seen in this scan.
    pub(crate) fn free(&self) -> Option<usize> {
        let free = self.slots.as_ref().iter().position(Option::is_none);
        free.or_else(|| {
            let unseen = self.occupied().filter(|(_, landmark)| landmark.unseen > 0);
            unseen.max_by_key(|(_, landmark)| landmark.unseen).map(|(slot, _)| slot)
        })
    }

    /// Enters a landmark that is seen for the first time; one that was found while driving (no `fixed` name) is given a
    /// name.
    pub(crate) fn enter(&mut self, slot: usize, fixed: Option<u16>, kind: LandmarkKind, orientation: f32) {
        let (source, id) = match fixed {
            Some(id) => (LandmarkSource::Fixed, id),
            None => {
                self.next_id = self.next_id.wrapping_add(1);
                (LandmarkSource::Dynamic, self.next_id)
            }
        };
        if let Some(place) = self.slots.as_mut().get_mut(slot) {
            *place = Some(Slot { source, id, kind, orientation, hits: 1, unseen: 0 });
        }
    }

    /// Notes that a landmark has been seen again.
    pub(crate) fn see(&mut self, slot: usize) {
        if let Some(Some(landmark)) = self.slots.as_mut().get_mut(slot) {
            landmark.hits = landmark.hits.saturating_add(1);
            landmark.unseen = 0;
        }
    }

    /// Ends a scan of features, or one of reflectors, which may come apart; `remove` is called with the slots of landmarks
    /// that go.
    pub(crate) fn finish(&mut self, are_reflectors: bool, parameters: &SlamParameters, mut remove: impl FnMut(usize)) {
        for (slot, place) in self.slots.as_mut().iter_mut().enumerate() {
            let Some(landmark) = place else { continue };
            if (landmark.kind == LandmarkKind::Reflector) != are_reflectors {
                continue;
            }
            // A reflector that was given needs nobody to confirm it.
            let is_believed = landmark.hits >= parameters.confirmed_hits
                || (are_reflectors && landmark.source == LandmarkSource::Fixed);
            if landmark.unseen > parameters.patience && !is_believed {
                remove(slot);
                *place = None;
            } else {
                landmark.unseen = landmark.unseen.saturating_add(1);
            }
        }
    }
}

impl Slot {
    /// Whether something of that kind and orientation (rad, in W) can be this landmark. A reflector has no orientation.
    pub(crate) fn resembles(&self, kind: LandmarkKind, orientation: f32, parameters: &SlamParameters) -> bool {
        let turn = difference(f64::from(orientation), f64::from(self.orientation));
        self.kind == kind
            && (kind == LandmarkKind::Reflector || libm::fabs(turn) <= f64::from(parameters.orientation_tolerance))
    }
}
