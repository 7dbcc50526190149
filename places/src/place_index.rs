//! Which stored places look like this one.

use heapless::Vec;

use super::glare::{Glare, ShiftedGlare};

/// A stored place that looks like the one asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Candidate {
    /// Number of the place, in order of storing.
    pub place: u32,
    /// Distance of the signatures.
    pub distance: u32,
}

/// Signatures of up to `PLACES` places.
#[derive(Clone, Debug, Default)]
pub struct PlaceIndex<const PLACES: usize> {
    signatures: Vec<Glare, PLACES>,
}

impl<const PLACES: usize> PlaceIndex<PLACES> {
    /// An empty index.
    #[must_use]
    pub const fn new() -> Self {
        Self { signatures: Vec::new() }
    }

    /// Stores the signature of the next place and returns its number. None if the index is full.
    pub fn push(&mut self, signature: Glare) -> Option<u32> {
        self.signatures.push(signature).ok()?;
        Some(self.signatures.len() as u32 - 1)
    }

    /// The stored signatures in order of their numbers.
    #[must_use]
    pub fn signatures(&self) -> &[Glare] {
        &self.signatures
    }

    /// Replaces `found` by the places for which `is_admissible` holds and whose signatures, under any shift, are nearest
    /// to `signature`, nearest first; among equals the earlier place comes first.
    pub fn search<const FOUND: usize>(
        &self,
        signature: &Glare,
        is_admissible: impl Fn(u32) -> bool,
        found: &mut Vec<Candidate, FOUND>,
    ) {
        let query = ShiftedGlare::new(signature);
        select(&self.signatures, is_admissible, |stored| query.distance(stored).0, found);
    }

    /// The same without shifts, for signatures that turning does not change.
    pub fn search_unshifted<const FOUND: usize>(
        &self,
        signature: &Glare,
        is_admissible: impl Fn(u32) -> bool,
        found: &mut Vec<Candidate, FOUND>,
    ) {
        select(&self.signatures, is_admissible, |stored| signature.unshifted_distance(stored), found);
    }
}

fn select<const FOUND: usize>(
    signatures: &[Glare],
    is_admissible: impl Fn(u32) -> bool,
    distance: impl Fn(&Glare) -> u32,
    found: &mut Vec<Candidate, FOUND>,
) {
    found.clear();
    for (place, stored) in (0_u32..).zip(signatures).filter(|(place, _)| is_admissible(*place)) {
        let candidate = Candidate { place, distance: distance(stored) };
        if found.is_full() {
            if found.last().is_none_or(|worst| worst.distance <= candidate.distance) {
                continue;
            }
            let _ = found.pop();
        }
        let position = found.partition_point(|other| other.distance <= candidate.distance);
        // There is room: a full list has just lost its last.
        let _ = found.insert(position, candidate);
    }
}
