//! Whether the vehicle stands.

use agv_core::measurement::{EncoderSample, Time};

/// A vehicle whose wheel has not moved for so long stands, s.
const STANDSTILL: f64 = 1.0;
/// By how much the counter of a wheel that stands may be off, ticks.
const TREMBLE: u32 = 3;

/// Remembers since when the driving wheel has not moved.
#[derive(Clone, Copy, Debug, Default)]
pub struct Standstill {
    /// The first sample at about this place of the driving wheel, and the time of the last one.
    stand: Option<(EncoderSample, Time)>,
}

impl Standstill {
    /// A vehicle whose encoders were never heard.
    #[must_use]
    pub const fn new() -> Self {
        Self { stand: None }
    }

    /// Takes what the encoders say.
    pub fn sample(&mut self, sample: &EncoderSample) {
        let stands = self.stand.map(|(first, _)| first).filter(|first| {
            let ticks = sample.drive.wrapping_sub(first.drive);
            ticks.min(ticks.wrapping_neg()) <= TREMBLE
        });
        self.stand = Some((stands.unwrap_or(*sample), sample.time));
    }

    /// Whether the wheel has not moved for a second, or there are no encoders that were ever heard.
    #[must_use]
    pub fn stands(&self, now: Time) -> bool {
        self.stand.is_none_or(|(first, last)| last.since(first.time) >= STANDSTILL && now.since(last) < STANDSTILL)
    }
}
