//! The vehicle's clock.

use serde::{Deserialize, Serialize};

/// An instant, microseconds since an arbitrary start that is the same for all events of one log.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Time(u64);

impl Time {
    /// The instant that many microseconds after the start.
    #[must_use]
    pub const fn from_micros(micros: u64) -> Self {
        Self(micros)
    }

    /// The instant that many seconds after the start, rounded to a microsecond; negative and NaN give the start.
    #[must_use]
    pub fn from_seconds(seconds: f64) -> Self {
        Self(libm::round(seconds * 1e6) as u64)
    }

    /// Microseconds since the start.
    #[must_use]
    pub const fn micros(self) -> u64 {
        self.0
    }

    /// Seconds since the start.
    #[must_use]
    pub fn seconds(self) -> f64 {
        self.0 as f64 * 1e-6
    }

    /// Seconds from `earlier` to this instant; negative if `earlier` is later.
    #[must_use]
    pub fn since(self, earlier: Time) -> f64 {
        if self.0 >= earlier.0 { (self.0 - earlier.0) as f64 * 1e-6 } else { -((earlier.0 - self.0) as f64 * 1e-6) }
    }

    /// The instant `seconds` later (earlier if negative), rounded to a microsecond, saturating at both ends.
    #[must_use]
    pub fn offset(self, seconds: f64) -> Time {
        let micros = libm::round(seconds * 1e6);
        if micros >= 0.0 {
            Time(self.0.saturating_add(micros as u64))
        } else {
            Time(self.0.saturating_sub((-micros) as u64))
        }
    }
}
