//! How regularly poses go to the bus.

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::time::Duration;

use agv_core::measurement::Time;
use serde::Serialize;

/// Longest period with a place of its own, us: ten of the longest ones that can be set. Longer ones share the last place.
const LONGEST: usize = 100_000;

/// A deadline is missed if a pose comes later than this share of a period after its time.
const LATE: f64 = 0.5;

/// Figures of the times between poses, ms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PeriodFigures {
    /// Half of them are not longer.
    pub p50: f64,
    /// All but one in a thousand are not longer.
    pub p999: f64,
    /// The longest.
    pub max: f64,
}

/// Times from pose to pose as they went to the bus. One thread notes them, others look; neither waits for the other.
pub struct Periods {
    /// How often there was a period of so many us.
    counts: Vec<AtomicU32>,
    poses: AtomicU64,
    longest: AtomicU64,
    missed: AtomicU64,
}

impl Default for Periods {
    fn default() -> Self {
        Self {
            counts: (0..=LONGEST).map(|_| AtomicU32::new(0)).collect(),
            poses: AtomicU64::new(0),
            longest: AtomicU64::new(0),
            missed: AtomicU64::new(0),
        }
    }
}

/// What notes the periods.
#[derive(Debug)]
pub struct PeriodClock {
    /// What is aimed at.
    period: Duration,
    last: Option<Time>,
}

impl PeriodClock {
    /// A clock for poses that ought to come that often.
    #[must_use]
    pub const fn new(period: Duration) -> Self {
        Self { period, last: None }
    }

    /// A pose went to the bus. Whether its deadline, or one before it, was missed.
    pub fn sent(&mut self, now: Time, periods: &Periods) -> bool {
        periods.poses.fetch_add(1, Ordering::Relaxed);
        let Some(last) = self.last.replace(now) else { return false };
        let passed = now.micros().saturating_sub(last.micros());
        let micros = usize::try_from(passed).unwrap_or(LONGEST).min(LONGEST);
        if let Some(count) = periods.counts.get(micros) {
            count.fetch_add(1, Ordering::Relaxed);
        }
        periods.longest.fetch_max(passed, Ordering::Relaxed);
        let share = 1e-6 * passed as f64 / self.period.as_secs_f64();
        let is_missed = share > 1.0 + LATE;
        if is_missed {
            periods.missed.fetch_add((share - LATE).floor().max(1.0) as u64, Ordering::Relaxed);
        }
        is_missed
    }

    /// There is no bus: the time until the next pose is no period.
    pub const fn interrupt(&mut self) {
        self.last = None;
    }
}

impl Periods {
    /// Poses on the bus.
    #[must_use]
    pub fn poses(&self) -> u64 {
        self.poses.load(Ordering::Relaxed)
    }

    /// Deadlines that passed without a pose.
    #[must_use]
    pub fn missed(&self) -> u64 {
        self.missed.load(Ordering::Relaxed)
    }

    /// The figures so far; zeros before the second pose.
    #[must_use]
    pub fn figures(&self) -> PeriodFigures {
        let counts: Vec<u64> = self.counts.iter().map(|count| count.load(Ordering::Relaxed).into()).collect();
        let all: u64 = counts.iter().sum();
        // The place at which so many are not longer.
        let place = |share: f64| {
            let wanted = (share * all as f64).ceil().max(1.0) as u64;
            let mut seen = 0;
            let found = counts.iter().position(|count| {
                seen += count;
                seen >= wanted
            });
            found.filter(|_| all > 0).map_or(0.0, |micros| 1e-3 * micros as f64)
        };
        let max = 1e-3 * self.longest.load(Ordering::Relaxed) as f64;
        PeriodFigures { p50: place(0.5), p999: place(0.999), max }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use agv_core::measurement::Time;

    use super::{PeriodClock, PeriodFigures, Periods};

    #[test]
    fn figures_are_those_of_the_times_between_poses() {
        let periods = Periods::default();
        assert_eq!(periods.figures(), PeriodFigures::default());
        let mut clock = PeriodClock::new(Duration::from_millis(10));
        let mut micros = 0;
        for number in 0..1001_u64 {
            micros = 10_000 * number + 5 * (number % 2);
            let time = Time::from_micros(micros);
            assert!(!clock.sent(time, &periods));
        }
        // Two poses are missing, then one is late by six tenths.
        micros += 30_000;
        assert!(clock.sent(Time::from_micros(micros), &periods));
        micros += 16_000;
        assert!(clock.sent(Time::from_micros(micros), &periods));
        assert_eq!((periods.poses(), periods.missed()), (1003, 3));
        // 500 of 9.995 ms, 500 of 10.005 ms and these two: the 501st and the 1001st of 1002.
        let PeriodFigures { p50, p999, max } = periods.figures();
        assert_eq!([p50, p999, max], [10.005, 16.0, 30.0]);
        // A bus that was away for an hour is no period.
        clock.interrupt();
        assert!(!clock.sent(Time::from_micros(micros + 3_600_000_000), &periods));
        assert_eq!((periods.figures().max, periods.missed()), (30.0, 3));
    }
}
