//! How long nobody has looked: a laser that tells nothing does not tell either that the vehicle is carried or slides.

use serde::{Deserialize, Serialize};

use crate::measurement::Time;
use crate::state::ProtectionLevel;

/// For so long, s, it is a telegram or some that were lost.
const USUAL: f64 = 1.0;

/// From then on the vehicle may have been moved by so much a second, m and rad: it is pushed by hand.
const MOVED: (f64, f64) = (0.1, 0.02);

/// When the laser was heard last, if it ever was.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Unheard {
    since: Option<Time>,
}

impl Unheard {
    /// It has not been heard: there may be none.
    #[must_use]
    pub const fn new() -> Self {
        Self { since: None }
    }

    /// It is heard.
    pub const fn hear(&mut self, now: Time) {
        self.since = Some(now);
    }

    /// A pose is given: nothing is asked of the time before.
    pub fn begin(&mut self, now: Time) {
        self.since = self.since.map(|_| now);
    }

    /// By how much bounds are wider at a time.
    #[must_use]
    pub fn widening(&self, now: Time) -> ProtectionLevel {
        let silent = self.since.map_or(0.0, |since| (now.since(since) - USUAL).max(0.0));
        ProtectionLevel { position: MOVED.0 * silent, heading: MOVED.1 * silent }
    }
}
