//! Correcting the filter by what is seen: the same for every state that it may have.

use super::association::{Association, Believed, Candidate, Comparison};
use super::landmark_maps::MapViews;
use super::landmark_slots::LandmarkSlots;
use super::sighting::Sighting;
use crate::filter::{Correction, Ekf, Innovation, Landmark, Slots};
use crate::geometry::Point;
use crate::maps::Verdict;
use crate::state::LandmarkSource;

/// What became of something that was seen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outcome {
    pub verdict: Verdict,
    /// The landmark that it was compared with, and the innovation.
    pub landmark: Option<(LandmarkSource, u16, Innovation)>,
    /// Where it is in W, m, from the pose before it was used.
    pub located: Point,
    /// Whether it has corrected the filter.
    pub is_used: bool,
}

impl Outcome {
    pub const OUT_OF_TIME: Self =
        Self { verdict: Verdict::OutOfTime, landmark: None, located: Point::new(0.0, 0.0), is_used: false };
}

/// Corrects a filter by something seen from its state. A landmark of a map that is recognised enters the state, if there are
/// `slots` and one can be freed. Tells what became of it, and the correction if one was made.
pub(crate) fn correct<S: Slots>(
    filter: &mut Ekf<S>,
    mut slots: Option<&mut LandmarkSlots<S>>,
    maps: &MapViews<'_>,
    seen: &Sighting,
    believed: Believed,
) -> (Outcome, Option<Correction>) {
    let comparison = Comparison::new(filter, seen, believed);
    let Association { verdict, nearest } = comparison.associate(maps, slots.as_deref());
    let (located, from, orientation) = (comparison.located, comparison.from, comparison.orientation());
    let Some(Candidate { source, id, landmark, innovation }) = nearest else {
        return (Outcome { verdict, landmark: None, located, is_used: false }, None);
    };
    let outcome = Outcome { verdict, landmark: Some((source, id, innovation)), located, is_used: false };
    if verdict != Verdict::Accepted {
        return (outcome, None);
    }
    let free = slots.as_deref().and_then(LandmarkSlots::free);
    let slot = match (landmark, free) {
        (Landmark::Slot(slot), _) => Some(slot),
        (Landmark::Known { position, variance }, Some(free)) => {
            filter.add_known_landmark(free, position, variance);
            if let Some(slots) = slots.as_deref_mut() {
                slots.enter(free, Some(id), seen.kind, orientation);
            }
            Some(free)
        }
        (Landmark::Known { .. }, None) => None,
    };
    let compared = slot.map_or(landmark, Landmark::Slot);
    let linearisation = filter.observe(&from, &seen.observation, &compared);
    let is_used = linearisation.is_some_and(|linearisation| filter.correct(&linearisation));
    if let Some((slots, slot)) = slots.zip(slot).filter(|_| is_used) {
        slots.see(slot);
    }
    let correction = match landmark {
        Landmark::Known { position, variance } if is_used => Some(Correction {
            observation: seen.observation,
            mount: seen.mount,
            landmark: position,
            landmark_variance: variance,
        }),
        _ => None,
    };
    (Outcome { is_used, ..outcome }, correction)
}
