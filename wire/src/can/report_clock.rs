//! When a report that comes by a timer was made.
//!
//! A node reads its counter by its own timer, but the bus is taken and receivers are slow: a frame may come late, never
//! early. So a report is taken to be one period younger than the one before, and what comes earlier than expected
//! corrects that at once, what comes later slowly. A node whose reports stay late has
//! lost some, or has another period.

use agv_core::measurement::Time;

/// Share of a lateness that is believed to be the node's own clock.
const GAIN: f64 = 0.02;
/// Reports in a row that do not become less late, after which they are believed.
const STEADY: u8 = 6;
/// Differences of lateness that do not count, in periods.
const SAME: f64 = 0.25;
/// Reports that are later than so many periods are not late: those before them are lost.
const LATEST: f64 = 2.5;

/// The timer of one node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReportClock {
    /// Time between reports, s.
    period: f64,
    last: Option<Time>,
    late: f64,
    steady: u8,
}

impl ReportClock {
    /// A timer with that period, s, that has not been heard.
    #[must_use]
    pub const fn new(period: f64) -> Self {
        Self { period, last: None, late: 0.0, steady: 0 }
    }

    /// When the report was made that arrived at `arrival`. Never later than that, and later than the one before if this
    /// arrived later.
    pub fn time(&mut self, arrival: Time) -> Time {
        let expected = self.last.map_or(arrival, |last| last.offset(self.period));
        let late = arrival.since(expected);
        // What was held up on the bus comes all at once, each less late than the one before.
        let is_steady = late > SAME * self.period && late > self.late - SAME * self.period;
        self.steady = if is_steady { self.steady.saturating_add(1) } else { 0 };
        let is_believed = late <= 0.0 || late > LATEST * self.period || self.steady >= STEADY;
        self.late = if is_believed { 0.0 } else { late };
        let time = if is_believed { arrival } else { expected.offset(GAIN * late) };
        self.last = Some(time);
        time
    }

    /// Forgets when reports were made.
    pub const fn restart(&mut self) {
        *self = Self::new(self.period);
    }
}
