//! The time of a live session.

use std::time::{Duration, Instant};

use agv_core::measurement::Time;

/// A clock that starts with the session. It can run faster than real time, for tests against emulated sensors.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    start: Instant,
    speed: f64,
}

/// What the clock shows at its start. Not zero, so that instants a little earlier exist.
const START: Time = Time::from_micros(10_000_000);

impl Clock {
    /// A clock that starts now. `speed` is 1 in real time.
    #[must_use]
    pub fn new(speed: f64) -> Self {
        Self { start: Instant::now(), speed }
    }

    /// The time.
    #[must_use]
    pub fn now(&self) -> Time {
        START.offset(self.start.elapsed().as_secs_f64() * self.speed)
    }

    /// How much faster than real time it runs.
    #[must_use]
    pub const fn speed(&self) -> f64 {
        self.speed
    }

    /// How long to wait for `time`; zero if it has passed.
    #[must_use]
    pub fn until(&self, time: Time) -> Duration {
        Duration::try_from_secs_f64(time.since(self.now()) / self.speed).unwrap_or_default()
    }
}
