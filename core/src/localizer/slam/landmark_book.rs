//! What is known of the landmarks in the state beside their positions.

use crate::geometry::difference;
use crate::localizer::LandmarkSource;
use crate::maps::LandmarkKind;

use super::SlamParameters;

/// A landmark in the state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BookEntry {
    pub source: LandmarkSource,
    pub id: u16,
    pub kind: LandmarkKind,
    /// Direction in W, rad.
    pub orientation: f32,
    hits: u16,
    /// Scans since it was seen.
    unseen: u16,
}

/// One entry for each place of the state.
#[derive(Clone, Debug)]
pub(super) struct LandmarkBook<const LANDMARKS: usize> {
    entries: [Option<BookEntry>; LANDMARKS],
    next_id: u16,
}

impl<const LANDMARKS: usize> LandmarkBook<LANDMARKS> {
    pub(super) const fn new() -> Self {
        Self { entries: [None; LANDMARKS], next_id: 0 }
    }

    pub(super) fn clear(&mut self) {
        self.entries.fill(None);
    }

    /// Forgets the landmarks that were given; `remove` is called with their places.
    pub(super) fn forget_given(&mut self, mut remove: impl FnMut(usize)) {
        for (place, slot) in self.entries.iter_mut().enumerate() {
            if slot.take_if(|entry| entry.source == LandmarkSource::Fixed).is_some() {
                remove(place);
            }
        }
    }

    /// The landmarks with their places in the state.
    pub(super) fn entries(&self) -> impl Iterator<Item = (usize, &BookEntry)> {
        self.entries.iter().enumerate().filter_map(|(place, entry)| Some((place, entry.as_ref()?)))
    }

    pub(super) fn has_fixed(&self, id: u16, kind: LandmarkKind) -> bool {
        self.entries().any(|(_, entry)| entry.source == LandmarkSource::Fixed && entry.id == id && entry.kind == kind)
    }

    /// Finds a place for a landmark: a free one, else that of the landmark that has not been seen for longest. None if all
    /// have been seen in this scan.
    pub(super) fn place(&self) -> Option<usize> {
        let free = self.entries.iter().position(Option::is_none);
        free.or_else(|| {
            let unseen = self.entries().filter(|(_, entry)| entry.unseen > 0);
            unseen.max_by_key(|(_, entry)| entry.unseen).map(|(place, _)| place)
        })
    }

    /// Enters a landmark that is seen for the first time; one that was found while driving (no `fixed` name) is given a
    /// name. Returns its name.
    pub(super) fn enter(&mut self, place: usize, fixed: Option<u16>, kind: LandmarkKind, orientation: f32) -> u16 {
        let (source, id) = match fixed {
            Some(id) => (LandmarkSource::Fixed, id),
            None => {
                self.next_id = self.next_id.wrapping_add(1);
                (LandmarkSource::Dynamic, self.next_id)
            }
        };
        if let Some(slot) = self.entries.get_mut(place) {
            *slot = Some(BookEntry { source, id, kind, orientation, hits: 1, unseen: 0 });
        }
        id
    }

    /// Notes that a landmark has been seen again.
    pub(super) fn see(&mut self, place: usize) {
        if let Some(Some(entry)) = self.entries.get_mut(place) {
            entry.hits = entry.hits.saturating_add(1);
            entry.unseen = 0;
        }
    }

    /// Ends a scan of features, or one of reflectors, which may come apart; `remove` is called with the places of landmarks
    /// that go.
    pub(super) fn finish(&mut self, are_reflectors: bool, parameters: &SlamParameters, mut remove: impl FnMut(usize)) {
        for (place, slot) in self.entries.iter_mut().enumerate() {
            let Some(entry) = slot else { continue };
            if (entry.kind == LandmarkKind::Reflector) != are_reflectors {
                continue;
            }
            // A reflector that was given needs nobody to confirm it.
            let is_believed =
                entry.hits >= parameters.confirmed_hits || (are_reflectors && entry.source == LandmarkSource::Fixed);
            if entry.unseen > parameters.patience && !is_believed {
                remove(place);
                *slot = None;
            } else {
                entry.unseen = entry.unseen.saturating_add(1);
            }
        }
    }
}

impl BookEntry {
    /// Whether something of that kind and orientation (rad, in W) can be this landmark. A reflector has no orientation.
    pub(super) fn resembles(&self, kind: LandmarkKind, orientation: f32, parameters: &SlamParameters) -> bool {
        let turn = difference(f64::from(orientation), f64::from(self.orientation));
        self.kind == kind
            && (kind == LandmarkKind::Reflector || libm::fabs(turn) <= f64::from(parameters.orientation_tolerance))
    }
}
