//! Encoder counters that wrap.

use serde::{Deserialize, Serialize};

/// No counter takes so many values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CounterRangeError;

impl core::fmt::Display for CounterRangeError {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter.write_str("a counter takes 2 to 2^32 values")
    }
}

impl core::error::Error for CounterRangeError {}

/// How many values a counter takes before it starts again at zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "u64", into = "u64")]
pub struct CounterRange(u64);

impl CounterRange {
    /// A counter of 16 bits.
    pub const BITS_16: Self = Self(1 << 16);
    /// A counter of 24 bits.
    pub const BITS_24: Self = Self(1 << 24);
    /// A counter of 32 bits.
    pub const BITS_32: Self = Self(1 << 32);

    /// A counter that takes `values` values, from 0 to `values - 1`. None unless 2 to 2^32.
    #[must_use]
    pub const fn new(values: u64) -> Option<Self> {
        if values >= 2 && values <= 1 << 32 { Some(Self(values)) } else { None }
    }

    /// The number of values.
    #[must_use]
    pub const fn values(self) -> u64 {
        self.0
    }

    /// The shortest step from one reading to the next, ticks, in `-values/2 .. values/2`. Readings at or beyond the
    /// range are taken modulo the range.
    #[must_use]
    pub const fn step(self, from: u32, to: u32) -> i64 {
        let values = self.0 as i64;
        if values == 0 {
            return 0;
        }
        let difference = to as i64 - from as i64;
        // A division of 64 bits is dear on the boards, and readings within the range need none.
        let forward = if difference >= values || difference <= -values {
            difference.rem_euclid(values)
        } else if difference < 0 {
            difference + values
        } else {
            difference
        };
        if forward >= values - values / 2 { forward - values } else { forward }
    }

    /// The reading at a position that may be beyond the range, ticks.
    #[must_use]
    pub const fn wrap(self, position: i64) -> u32 {
        match position.checked_rem_euclid(self.0 as i64) {
            Some(reading) => reading as u32,
            None => 0,
        }
    }

    /// The reading as a signed number around zero, ticks.
    #[must_use]
    pub const fn signed(self, reading: u32) -> i64 {
        self.step(0, reading)
    }
}

/// Ticks as a number. The boards convert 32 bits in one instruction, and 64 by a routine.
pub(super) fn ticks_as_f64(ticks: i64) -> f64 {
    i32::try_from(ticks).map_or_else(|_| ticks as f64, f64::from)
}

impl TryFrom<u64> for CounterRange {
    type Error = CounterRangeError;

    fn try_from(values: u64) -> Result<Self, CounterRangeError> {
        Self::new(values).ok_or(CounterRangeError)
    }
}

impl From<CounterRange> for u64 {
    fn from(range: CounterRange) -> Self {
        range.values()
    }
}
