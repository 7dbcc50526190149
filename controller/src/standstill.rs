//! Whether the vehicle stands.

use agv_core::measurement::Time;

/// A vehicle whose wheel has not moved for so long stands, s.
const STANDSTILL: f64 = 1.0;
/// By how much the counter of a wheel that stands may be off, ticks.
const TREMBLE: u32 = 3;

/// Remembers since when no driven wheel has moved.
#[derive(Clone, Copy, Debug, Default)]
pub struct Standstill {
    /// Time and counters of the first sample at about this place of the wheels, and the time of the last one.
    stand: Option<((Time, [u32; 2]), Time)>,
}

impl Standstill {
    /// A vehicle whose encoders were never heard.
    #[must_use]
    pub const fn new() -> Self {
        Self { stand: None }
    }

    /// Takes what the counters of the driven wheels say; that of a wheel which a vehicle does not have never moves.
    pub fn sample(&mut self, time: Time, counters: [u32; 2]) {
        let stands = self.stand.map(|(first, _)| first).filter(|(_, first)| {
            counters.iter().zip(first).all(|(now, first)| {
                let ticks = now.wrapping_sub(*first);
                ticks.min(ticks.wrapping_neg()) <= TREMBLE
            })
        });
        self.stand = Some((stands.unwrap_or((time, counters)), time));
    }

    /// Whether the wheel has not moved for a second, or there are no encoders that were ever heard.
    #[must_use]
    pub fn stands(&self, now: Time) -> bool {
        self.stand.is_none_or(|((first, _), last)| last.since(first) >= STANDSTILL && now.since(last) < STANDSTILL)
    }
}
