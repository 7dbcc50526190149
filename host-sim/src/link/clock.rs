//! The time of a live session.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use agv_core::measurement::Time;

/// A clock that starts with the session. It can run faster than real time, for tests against emulated sensors, or stand until somebody
/// moves its hand.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    start: Instant,
    speed: f64,
    hand: Option<&'static AtomicU64>,
}

/// What the clock shows at its start. Not zero, so that instants a little earlier exist.
const START: Time = Time::from_micros(10_000_000);

impl Clock {
    /// A clock that starts now. `speed` is 1 in real time.
    #[must_use]
    pub fn new(speed: f64) -> Self {
        Self { start: Instant::now(), speed, hand: None }
    }

    /// A clock that shows so many microseconds. Nobody waits for it.
    #[must_use]
    pub fn by_hand(hand: &'static AtomicU64) -> Self {
        Self { start: Instant::now(), speed: 1.0, hand: Some(hand) }
    }

    /// The time.
    #[must_use]
    pub fn now(&self) -> Time {
        match self.hand {
            Some(hand) => Time::from_micros(hand.load(Ordering::Relaxed)),
            None => START.offset(self.start.elapsed().as_secs_f64() * self.speed),
        }
    }

    /// How much faster than real time it runs.
    #[must_use]
    pub const fn speed(&self) -> f64 {
        self.speed
    }

    /// How long to wait for `time`; zero if it has passed.
    #[must_use]
    pub fn until(&self, time: Time) -> Duration {
        if self.hand.is_some() {
            return Duration::ZERO;
        }
        Duration::try_from_secs_f64(time.since(self.now()) / self.speed).unwrap_or_default()
    }
}
