//! Whether the vehicle stands.

use agv_core::measurement::{PoseIncrement, SpeedSample, Time};
use agv_core::odometry::MOST_COUNTERS;

/// A vehicle whose wheel has not moved for so long stands, s.
const STANDSTILL: f64 = 1.0;
/// By how much the counter of a wheel that stands may be off, ticks.
const TREMBLE: u32 = 3;
/// What the vehicle's own controller may say of one that stands, m/s.
const SLOWEST: f64 = 2e-3;
/// The same of an increment: m, and rad.
const LEAST: f64 = 2e-4;

/// Remembers since when no driven wheel has moved.
#[derive(Clone, Copy, Debug, Default)]
pub struct Standstill {
    /// Time and counters of the first sample at about this place of the wheels, and the time of the last one.
    stand: Option<((Time, [u32; MOST_COUNTERS]), Time)>,
}

impl Standstill {
    /// A vehicle whose encoders were never heard.
    #[must_use]
    pub const fn new() -> Self {
        Self { stand: None }
    }

    /// Takes what the counters of the driven wheels say; that of a wheel which a vehicle does not have never moves.
    pub fn sample(&mut self, time: Time, counters: [u32; MOST_COUNTERS]) {
        let stands = self.stand.map(|(first, _)| first).filter(|(_, first)| {
            counters.iter().zip(first).all(|(now, first)| {
                let ticks = now.wrapping_sub(*first);
                ticks.min(ticks.wrapping_neg()) <= TREMBLE
            })
        });
        self.stand = Some((stands.unwrap_or((time, counters)), time));
    }

    /// Takes what the vehicle's own controller says of its speed.
    pub fn speed(&mut self, sample: &SpeedSample) {
        self.report(sample.time, libm::fabs(sample.speed) <= SLOWEST);
    }

    /// Takes what the vehicle's own controller says of its way.
    pub fn increment(&mut self, increment: &PoseIncrement) {
        let moved = increment.displacement;
        self.report(increment.time, [moved.x, moved.y, moved.theta].iter().all(|part| libm::fabs(*part) <= LEAST));
    }

    fn report(&mut self, time: Time, stands: bool) {
        let none = (time, [0; MOST_COUNTERS]);
        let first = self.stand.filter(|_| stands).map_or(none, |(first, _)| first);
        self.stand = Some((first, time));
    }

    /// Whether the wheel has not moved for a second, or there are no encoders that were ever heard.
    #[must_use]
    pub fn stands(&self, now: Time) -> bool {
        self.stand.is_none_or(|((first, _), last)| last.since(first) >= STANDSTILL && now.since(last) < STANDSTILL)
    }
}
