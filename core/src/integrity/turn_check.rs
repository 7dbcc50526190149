//! Whether wheels and gyro turn alike.
//!
//! What they tell differently is summed over some way and held against the deviations that both state: their noise, and what
//! lasts of their errors. More than that is slip of a wheel, if the gyro is not found to be wrong by itself: one that tells the same
//! number again and again, is at the end of its range, is silent, or tells another bias at rest.

use serde::{Deserialize, Serialize};

use crate::measurement::{GyroSample, Time};
use crate::odometry::Motion;

/// Way over which differences are summed, m; a second sum begins in the middle of each.
const WINDOW: f64 = 0.3;
/// Longest time of a sum, s.
const LONGEST: f64 = 3.0;
/// A difference of more deviations is none of a vehicle in order.
const GATE: f64 = 6.0;
/// How long, s, what was found is told.
const TOLD_FOR: f64 = 1.0;
/// So many equal readings in a row, while the wheels move, are of a gyro that is frozen: the noise of two readings is the same
/// once in a dozen times at a twentieth of a degree a second and sixteen bits.
const FROZEN: u16 = 10;
/// A gyro that has told no turn for so long while the wheels move is missing, s: with 20 readings a second one may be missed.
const MISSING_AFTER: f64 = 0.11;
/// How far the clocks of wheels and gyro may be apart, s.
const CLOCK: f64 = 0.01;

/// What is wrong with a gyro.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum GyroFault {
    /// Nothing is heard.
    Missing,
    /// It tells the same number again and again.
    Frozen,
    /// It turns faster than it can tell.
    Clipped,
    /// It tells another bias than before.
    Jumped,
}

/// What lasts of the errors of wheels and gyro: standard deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LastingErrors {
    /// Turn that the wheels do not tell, rad/m.
    pub steering: f64,
    /// Share of the turn.
    pub turn: f64,
    /// Bias of the gyro, rad/s.
    pub bias: f64,
    /// Turn for a tick of a wheel, rad: a sum of turns is off by as much.
    pub step: f64,
}

/// Differences since a time.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Window {
    difference: f64,
    variance: f64,
    way: f64,
    turned: f64,
    time: f64,
    rate: f64,
}

impl Window {
    const EMPTY: Self = Self::from_rate(0.0);

    const fn from_rate(rate: f64) -> Self {
        Self { difference: 0.0, variance: 0.0, way: 0.0, turned: 0.0, time: 0.0, rate }
    }

    fn is_before_middle(&self) -> bool {
        self.way < 0.5 * WINDOW && self.time < 0.5 * LONGEST
    }

    fn is_over(&self) -> bool {
        self.way >= WINDOW || self.time >= LONGEST
    }

    /// The square of the difference over its variance.
    fn ratio(&self, rate: f64, lasting: &LastingErrors) -> f64 {
        let square = |value: f64| value * value;
        let expected = self.variance
            + square(lasting.steering * self.way)
            + square(lasting.turn * self.turned)
            + square(lasting.bias * self.time)
            + square(CLOCK * (rate - self.rate))
            + square(lasting.step);
        if expected > 0.0 { square(self.difference) / expected } else { 0.0 }
    }
}

/// The sums, and what was found.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct TurnCheck {
    windows: [Window; 2],
    rate: f64,
    slips_until: Option<Time>,
    /// How far the heading of the wheels was off while they were found to slip, rad.
    slipped: f64,
    fault: Option<(GyroFault, Time)>,
    last: Option<f64>,
    equal: u16,
    has_moved: bool,
    /// Since when the gyro has told no turn.
    untold: Option<Time>,
}

impl TurnCheck {
    /// A check that has seen nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            windows: [Window::EMPTY; 2],
            rate: 0.0,
            slips_until: None,
            slipped: 0.0,
            fault: None,
            last: None,
            equal: 0,
            has_moved: false,
            untold: None,
        }
    }

    /// Takes a reading of the gyro. False if the gyro is frozen.
    pub fn sample(&mut self, sample: &GyroSample) -> bool {
        let is_equal = self.last.replace(sample.rate).is_some_and(|last| last.total_cmp(&sample.rate).is_eq());
        if !is_equal {
            (self.equal, self.has_moved) = (0, false);
            return true;
        }
        self.equal = self.equal.saturating_add(1);
        let is_frozen = self.equal >= FROZEN && self.has_moved;
        if is_frozen {
            self.raise(GyroFault::Frozen, sample.time);
        }
        !is_frozen
    }

    /// Something is wrong with the gyro.
    pub fn raise(&mut self, fault: GyroFault, now: Time) {
        self.fault = Some((fault, now));
        self.windows = [Window::EMPTY; 2];
    }

    /// The wheels have told a motion of which the gyro has told no turn, or need not tell one, as the vehicle `stands`.
    pub fn travel_alone(&mut self, motion: &Motion, stands: bool) {
        self.has_moved |= motion.distance > 0.0;
        self.windows = [Window::EMPTY; 2];
        if stands {
            self.untold = None;
            return;
        }
        let since = *self.untold.get_or_insert(motion.start);
        if motion.end.since(since) > MISSING_AFTER
            && self.fault(motion.end).is_none_or(|fault| fault == GyroFault::Missing)
        {
            self.raise(GyroFault::Missing, motion.end);
        }
    }

    /// The wheels have told `wheels`, and the gyro the motion `gyro`, at whose end it turned at `rate`, rad/s. Gives the square of the
    /// difference over what is expected of it, over the gate.
    pub fn travel(&mut self, wheels: &Motion, gyro: &Motion, rate: f64, lasting: &LastingErrors) -> f64 {
        self.has_moved |= wheels.distance > 0.0;
        self.untold = None;
        let difference = wheels.displacement.theta - gyro.displacement.theta;
        let now = wheels.end;
        let [first, second] = &mut self.windows;
        let begun = Window::from_rate(core::mem::replace(&mut self.rate, rate));
        if first.is_over() {
            *first = core::mem::replace(second, begun);
        }
        if first.is_before_middle() {
            *second = begun;
        }
        let mut largest: f64 = 0.0;
        for window in &mut self.windows {
            window.difference += difference;
            window.variance += wheels.covariance.m33 + gyro.covariance.m33;
            window.way += wheels.distance;
            window.turned += libm::fabs(gyro.displacement.theta);
            window.time += now.since(wheels.start);
            largest = largest.max(window.ratio(rate, lasting));
        }
        let ratio = largest / (GATE * GATE);
        if ratio > 1.0 {
            self.slips_until = Some(now.offset(TOLD_FOR));
            self.slipped += libm::fabs(difference);
        } else if !self.slips(now) {
            self.slipped = 0.0;
        }
        ratio
    }

    /// Whether a wheel slips.
    #[must_use]
    pub fn slips(&self, now: Time) -> bool {
        self.slips_until.is_some_and(|until| now <= until)
    }

    /// How far the heading of the wheels has gone astray since they slip, rad.
    #[must_use]
    pub const fn slipped(&self) -> f64 {
        self.slipped
    }

    /// What is wrong with the gyro.
    #[must_use]
    pub fn fault(&self, now: Time) -> Option<GyroFault> {
        self.fault.filter(|(_, since)| now.since(*since) <= TOLD_FOR).map(|(fault, _)| fault)
    }
}

impl Default for TurnCheck {
    fn default() -> Self {
        Self::new()
    }
}
