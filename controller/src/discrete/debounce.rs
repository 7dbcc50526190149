//! Levels of contacts that bounce.

use agv_core::measurement::Time;

/// A level counts when it has held for so long, s: contacts bounce for 6.2 ms at most, but for a few odd ones, and 20 to 50 ms are
/// recommended (J. Ganssle, A Guide to Debouncing, 2004).
pub const DEBOUNCE: f64 = 0.020;

/// What a debounced level has become.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Level {
    /// Whether it is high.
    pub is_high: bool,
    /// Whether it has risen just now: it was low, and known to be.
    pub has_risen: bool,
}

/// A level that is believed when it has held.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Debounced {
    /// None before one has held.
    believed: Option<bool>,
    /// What was read last, and since when it is read.
    read: Option<(bool, Time)>,
}

impl Debounced {
    /// Takes what is read at `now`.
    pub fn read(&mut self, is_high: bool, now: Time) -> Level {
        let same = self.read.filter(|(before, _)| *before == is_high);
        let (_, since) = *self.read.insert(same.unwrap_or((is_high, now)));
        let before = self.believed;
        if now.since(since) >= DEBOUNCE {
            self.believed = Some(is_high);
        }
        let is_high = self.believed == Some(true);
        Level { is_high, has_risen: is_high && before == Some(false) }
    }

    /// It cannot be read: nothing is known of it any more.
    pub fn forget(&mut self) -> Level {
        *self = Self::default();
        Level { is_high: false, has_risen: false }
    }
}
