//! What of the landmarks contradicts the pose, and by how much that widens its bound: nobody can tell which of them are right.

use crate::state::ProtectionLevel;

/// More than this share of what is seen contradicts the pose, if it is so many at least; fewer may be false reflectors.
const CONTRADICTED: f64 = 0.25;
const LEAST_CONTRADICTING: f64 = 2.5;
/// What they count from one event to the next.
const FADING: f64 = 0.8;
/// Over this distance, m, the widening is forgotten by 1/e.
const MEMORY: f64 = 5.0;

/// What fits the pose and what contradicts it.
#[derive(Clone, Copy, Debug)]
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
#[derive(Clone, Debug)]
pub struct Contradiction {
    event: Evidence,
    lately: Evidence,
    widening: ProtectionLevel,
}

impl Contradiction {
    /// Nothing contradicts the pose.
    #[must_use]
    pub const fn new() -> Self {
        Self { event: Evidence::NONE, lately: Evidence::NONE, widening: ProtectionLevel::NONE }
    }

    /// Takes a distance, m, over which contradictions are forgotten.
    pub fn travel(&mut self, distance: f64) {
        let remaining = libm::exp(-distance / MEMORY);
        self.widening.position *= remaining;
        self.widening.heading *= remaining;
    }

    /// Begins to take what one event tells.
    pub fn begin_event(&mut self) {
        self.event = Evidence::NONE;
    }

    /// Takes a landmark that fits.
    pub fn fit(&mut self) {
        self.event.fitting += 1.0;
    }

    /// Takes one that is so far from where it should be, m, and so far from the laser, m.
    pub fn contradict(&mut self, by: f64, range: f64) {
        self.event.contradicting += 1.0;
        self.event.by.0 += by;
        self.event.by.1 += by / range.max(1.0);
    }

    /// Ends the event; true if it contradicts the pose.
    pub fn end_event(&mut self) -> bool {
        self.lately.add(&self.event);
        for evidence in [&self.event, &self.lately] {
            if evidence.share() > CONTRADICTED && evidence.contradicting >= LEAST_CONTRADICTING {
                self.widening = self.widening.or(&evidence.mean());
            }
        }
        self.event.share() > CONTRADICTED
    }

    /// By how much the bound is wider.
    #[must_use]
    pub fn widening(&self) -> ProtectionLevel {
        self.widening
    }
}
