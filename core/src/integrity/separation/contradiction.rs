//! What of the landmarks contradicts the pose, and by how much that widens its bound: nobody can tell which of them are right. What a
//! minority contradicts in one event alone, and none of the map, is no more than false reflectors are.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::state::ProtectionLevel;

/// More than this share of what is seen contradicts the pose, if it is so many at least; fewer may be false reflectors.
const CONTRADICTED: f64 = 0.25;
const LEAST_CONTRADICTING: f64 = 2.5;
/// Landmarks that are elsewhere by the same, within this distance, m, were moved together, or the vehicle was with the others: so many of
/// them contradict the pose if they are more than this share of what is seen.
const ALIKE_WITHIN: f64 = 0.05;
const LEAST_ALIKE: usize = 2;
const ALIKE: f64 = 0.1;
/// Two false reflectors happen to be alike: so it must be so many, or they alone more than this share of what is seen, or some in two events
/// in a row.
const SURELY_ALIKE: usize = 3;
const LARGE_SHARE: f64 = 0.3;
/// Displacements that are compared in an event.
const COMPARED: usize = 8;
/// What they count from one event to the next.
const FADING: f64 = 0.8;
/// Over this distance, m, a widening that lasts is forgotten by 1/e.
const MEMORY: f64 = 10.0;

/// What fits the pose and what contradicts it.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Evidence {
    fitting: f64,
    contradicting: f64,
    /// Sum of how far the latter are from where they should be, m, and of that over their distance, rad.
    by: (f64, f64),
}

impl Evidence {
    const NONE: Self = Self { fitting: 0.0, contradicting: 0.0, by: (0.0, 0.0) };

    fn share(&self) -> f64 {
        self.contradicting / (self.fitting + self.contradicting).max(1e-3)
    }

    fn mean(&self) -> ProtectionLevel {
        let count = self.contradicting.max(1e-3);
        ProtectionLevel { position: self.by.0 / count, heading: self.by.1 / count }
    }

    /// Adds an event to those before, which count by less and less.
    fn add(&mut self, event: &Self) {
        let add = |sum: f64, value: f64| FADING * sum + value;
        *self = Self {
            fitting: add(self.fitting, event.fitting),
            contradicting: add(self.contradicting, event.contradicting),
            by: (add(self.by.0, event.by.0), add(self.by.1, event.by.1)),
        };
    }
}

/// The evidence of the present event and of the last ones, and what came of it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Contradiction {
    event: Evidence,
    /// By how much landmarks of the event are elsewhere in W, m.
    displaced: Vec<[f64; 2], COMPARED>,
    lately: Evidence,
    /// How many of them are elsewhere by the same, and were in the event before that saw anything.
    alike: [usize; 2],
    /// What the last event that saw anything has found, and whether more of it contradicted the pose than fitted.
    found: ProtectionLevel,
    is_outnumbered: bool,
    /// What landmarks of the map have shown, or two events in a row: false reflectors are of none, and are not seen again.
    lasting: ProtectionLevel,
}

impl Contradiction {
    /// Nothing contradicts the pose.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            event: Evidence::NONE,
            displaced: Vec::new(),
            lately: Evidence::NONE,
            alike: [0; 2],
            found: ProtectionLevel::NONE,
            is_outnumbered: false,
            lasting: ProtectionLevel::NONE,
        }
    }

    /// Takes a distance, m, over which contradictions are forgotten.
    pub fn travel(&mut self, distance: f64) {
        let remaining = libm::exp(-distance / MEMORY);
        self.lasting.position *= remaining;
        self.lasting.heading *= remaining;
    }

    /// Begins to take what one event tells.
    pub fn begin_event(&mut self) {
        self.event = Evidence::NONE;
        self.displaced.clear();
    }

    /// Takes a landmark that fits.
    pub fn fit(&mut self) {
        self.event.fitting += 1.0;
    }

    /// Takes one that is elsewhere by so much in W, m, and so far from the laser, m.
    pub fn displace(&mut self, by: [f64; 2], range: f64) {
        // What exceeds the room counts all the same, but is not compared.
        let _ = self.displaced.push(by);
        let [x, y] = by;
        self.contradict(libm::hypot(x, y), range);
    }

    /// Takes one that belongs to none of the map within so many m, and is so far from the laser, m.
    pub fn contradict(&mut self, by: f64, range: f64) {
        self.event.contradicting += 1.0;
        self.event.by.0 += by;
        self.event.by.1 += by / range.max(1.0);
    }

    /// Ends the event; true if it contradicts the pose.
    pub fn end_event(&mut self) -> bool {
        self.lately.add(&self.event);
        if self.event.fitting + self.event.contradicting > 0.0 {
            let before = self.found;
            let [last, _] = self.alike;
            self.alike = [self.number_alike(), last];
            self.found = if self.event.fitting > 0.0 { self.find() } else { self.found.or(&self.find()) };
            self.is_outnumbered = self.event.contradicting > self.event.fitting;
            let is_moved = self.are_alike() || self.displaced.len() as f64 >= LEAST_CONTRADICTING;
            if is_moved || before != ProtectionLevel::NONE {
                self.lasting = self.lasting.or(&self.found);
            }
        }
        self.event.share() > CONTRADICTED
    }

    fn find(&self) -> ProtectionLevel {
        let mut level = ProtectionLevel::NONE;
        for evidence in [&self.event, &self.lately] {
            if evidence.share() > CONTRADICTED && evidence.contradicting >= LEAST_CONTRADICTING {
                level = level.or(&evidence.mean());
            }
        }
        if self.are_alike() && self.event.share() > ALIKE {
            level = level.or(&self.event.mean());
        }
        level
    }

    /// Whether enough landmarks are elsewhere by the same.
    fn are_alike(&self) -> bool {
        let [now, last] = self.alike;
        let is_large = now as f64 > LARGE_SHARE * (self.event.fitting + self.event.contradicting);
        now >= SURELY_ALIKE || (now >= LEAST_ALIKE && (is_large || last >= LEAST_ALIKE))
    }

    /// How many landmarks are elsewhere by the same at most.
    fn number_alike(&self) -> usize {
        let near = |one: &[f64; 2], other: &[f64; 2]| {
            let [[x, y], [other_x, other_y]] = [*one, *other];
            libm::hypot(x - other_x, y - other_y) <= ALIKE_WITHIN
        };
        let count = |one: &[f64; 2]| self.displaced.iter().filter(|other| near(one, other)).count();
        self.displaced.iter().map(count).max().unwrap_or_default()
    }

    /// By how much the bound is wider.
    #[must_use]
    pub fn widening(&self) -> ProtectionLevel {
        if self.is_outnumbered { self.lasting.or(&self.found) } else { self.lasting }
    }
}
