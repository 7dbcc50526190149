//! How a protection level grows while the vehicle goes on as it does.

use serde::{Deserialize, Serialize};

use super::ProtectionLevel;

/// How long the vehicle has gone on, s.
const SECONDS: [f64; 3] = [0.02, 0.06, 0.2];

/// What a motion at the present velocity adds to a level after 0.02, 0.06 and 0.2 s.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LevelGrowth {
    added: [ProtectionLevel; SECONDS.len()],
}

impl LevelGrowth {
    /// The level stays.
    pub const NONE: Self = Self { added: [ProtectionLevel::NONE; SECONDS.len()] };

    /// By what is added after a time, s.
    #[must_use]
    pub fn of(added: impl Fn(f64) -> ProtectionLevel) -> Self {
        Self { added: SECONDS.map(added) }
    }

    /// What is added after a time, s: linear in between, and beyond.
    #[must_use]
    pub fn after(&self, seconds: f64) -> ProtectionLevel {
        let (mut from, mut before) = (0.0, ProtectionLevel::NONE);
        let mut level = ProtectionLevel::NONE;
        for (number, (until, added)) in SECONDS.iter().zip(&self.added).enumerate() {
            let share = (seconds - from) / (until - from);
            let between = |before: f64, added: f64| (before + share * (added - before)).max(0.0);
            level = ProtectionLevel {
                position: between(before.position, added.position),
                heading: between(before.heading, added.heading),
            };
            if seconds <= *until || number + 1 == SECONDS.len() {
                break;
            }
            (from, before) = (*until, *added);
        }
        level
    }
}
