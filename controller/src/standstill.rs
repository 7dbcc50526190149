//! Whether the vehicle stands.

use agv_core::geometry::Pose;
use agv_core::measurement::{PoseIncrement, SpeedSample, Time};
use agv_core::odometry::{Counted, CounterRange, MOST_COUNTERS, Vehicle};

/// A vehicle whose wheel has not moved for so long stands, s.
const STANDSTILL: f64 = 1.0;
/// By how much the counter of a wheel that stands may be off, ticks.
const TREMBLE: u64 = 3;
/// What the vehicle's own controller may say of one that stands, m/s and rad/s.
const SLOWEST: f64 = 2e-3;

/// Remembers since when no driven wheel has moved.
#[derive(Clone, Copy, Debug)]
pub struct Standstill {
    /// Of the counters of the driven wheels.
    ranges: [CounterRange; MOST_COUNTERS],
    stand: Option<Stand>,
}

/// Since when the wheels are at about the same place.
#[derive(Clone, Copy, Debug)]
struct Stand {
    since: Time,
    /// The last report.
    last: Time,
    /// Counters of the first one.
    counters: [u32; MOST_COUNTERS],
    /// How far the vehicle has moved since by its own account.
    moved: Pose,
}

impl Stand {
    const fn new(time: Time, counters: [u32; MOST_COUNTERS]) -> Self {
        Self { since: time, last: time, counters, moved: Pose { x: 0.0, y: 0.0, theta: 0.0 } }
    }
}

impl Standstill {
    /// A vehicle whose encoders were never heard.
    #[must_use]
    pub fn new(vehicle: &Vehicle) -> Self {
        let mut ranges = [CounterRange::BITS_32; MOST_COUNTERS];
        for counter in vehicle.counters().iter().filter(|counter| counter.counted == Counted::Turn) {
            if let Some(range) = ranges.get_mut(counter.wheel) {
                *range = counter.range;
            }
        }
        Self { ranges, stand: None }
    }

    /// Takes what the counters of the driven wheels say; that of a wheel which a vehicle does not have never moves.
    pub fn sample(&mut self, time: Time, counters: [u32; MOST_COUNTERS]) {
        let is_here = |stand: &Stand| {
            let readings = stand.counters.iter().zip(&counters);
            self.ranges.iter().zip(readings).all(|(range, (from, to))| range.step(*from, *to).unsigned_abs() <= TREMBLE)
        };
        let stand = self.stand.filter(is_here).unwrap_or(Stand::new(time, counters));
        self.stand = Some(Stand { last: time, ..stand });
    }

    /// Takes what the vehicle's own controller says of its speed.
    pub fn speed(&mut self, sample: &SpeedSample) {
        let stands = libm::fabs(sample.speed) <= SLOWEST;
        let stand = self.stand.filter(|_| stands).unwrap_or(Stand::new(sample.time, [0; MOST_COUNTERS]));
        self.stand = Some(Stand { last: sample.time, ..stand });
    }

    /// Takes what the vehicle's own controller says of its way: one that goes no further than the slowest speed in that time stands.
    pub fn increment(&mut self, increment: &PoseIncrement) {
        let PoseIncrement { time, displacement } = increment;
        let farthest = SLOWEST * STANDSTILL;
        let go_on = |stand: Stand| Stand { moved: stand.moved.compose(displacement), ..stand };
        let is_here = |stand: &Stand| {
            let Pose { x, y, theta } = stand.moved;
            [x, y, theta].iter().all(|part| libm::fabs(*part) <= farthest)
        };
        let stand = self.stand.map(go_on).filter(is_here).unwrap_or(Stand::new(*time, [0; MOST_COUNTERS]));
        self.stand = Some(Stand { last: *time, ..stand });
    }

    /// Whether the wheel has not moved for a second, or there are no encoders that were ever heard.
    #[must_use]
    pub fn stands(&self, now: Time) -> bool {
        let is_still = |stand: Stand| stand.last.since(stand.since) >= STANDSTILL && now.since(stand.last) < STANDSTILL;
        self.stand.is_none_or(is_still)
    }
}
