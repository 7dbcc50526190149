//! When the vehicle stands still.

use agv_core::measurement::Time;

use super::counted::Counted;

/// A time of standstill.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Standstill {
    /// When the driving wheel stopped.
    pub start: Time,
    /// When it moved again.
    pub end: Time,
}

impl Standstill {
    /// The middle.
    #[must_use]
    pub fn middle(&self) -> Time {
        self.start.offset(0.5 * self.end.since(self.start))
    }
}

/// A standstill lasts at least so long, s.
const SHORTEST: f64 = 0.4;
/// The driving wheel may tremble by so much, m.
const TREMOR: f64 = 3e-4;
/// What the vehicle still swings after it has stopped, s.
const SETTLING: f64 = 0.1;

/// All times at which the driving wheel stands for long enough, without the first moment of each.
#[must_use]
pub fn standstills(counted: &[Counted], drive_scale: f64) -> Vec<Standstill> {
    let tremor = (TREMOR / drive_scale).max(1.0);
    let mut found = Vec::new();
    let mut first = 0;
    while first < counted.len() {
        let here = counted[first].ticks;
        let moved = counted[first..].iter().position(|sample| (sample.ticks - here).abs() > tremor);
        let end = first + moved.unwrap_or(counted.len() - first);
        let (start, stop) = (counted[first].time.offset(SETTLING), counted[end - 1].time);
        if stop.since(start) >= SHORTEST {
            found.push(Standstill { start, end: stop });
            first = end;
        } else {
            first += 1;
        }
    }
    found
}
