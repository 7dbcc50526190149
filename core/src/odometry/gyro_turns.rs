//! Rates of a gyro into the turn of each motion.

use heapless::Deque;
use serde::{Deserialize, Serialize};

use super::{GyroErrors, GyroParameters, Motion};
use crate::geometry::Pose;
use crate::measurement::{GyroSample, Time};

/// Angles that are remembered, and the time between two of them at least, s: the wheels may report later than the gyro by 0.14 s.
const REMEMBERED: usize = 16;
const SPACING: f64 = 0.01;
/// A gyro that has said nothing for so long, s, tells no turn: of one with 20 readings a second one may be missed.
const LONGEST_SILENCE: f64 = 0.11;
/// After so many readings in a row that follow each other but are not later than the one before, that one had a wrong time.
const MOST_EARLIER: u8 = 10;

/// The turn of a motion as a gyro tells it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GyroTurn {
    /// Integral of the told rate, rad.
    pub angle: f64,
    /// For how long, s.
    pub duration: f64,
    /// Variance of the integral by the noise, and by what the rate may have done between two readings, rad^2.
    pub variance: f64,
}

impl GyroTurn {
    /// The turn without the errors, rad.
    #[must_use]
    pub fn corrected(&self, errors: &GyroErrors) -> f64 {
        (1.0 + errors.scale) * self.angle - errors.bias * self.duration
    }
}

/// Why a reading of a gyro tells no turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GyroRefusal {
    /// It is not later than the one before.
    OutOfOrder,
    /// It is as large as the gyro can tell, or not finite.
    Clipped,
}

/// Integrates rates. Behind the last sample its rate is held; what was held wrongly is made up for by the next motion, so that the
/// sum of all turns is the integral.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct GyroTurns {
    parameters: GyroParameters,
    /// Times and angles, rad.
    angles: Deque<(Time, f64), REMEMBERED>,
    rate: f64,
    /// By how much the last two rates differ, rad/s, and the time between them, s.
    change: f64,
    period: f64,
    /// Whether nothing was heard for long before the last reading.
    is_after_gap: bool,
    /// Readings in a row that are not later than the last one, and the newest of them.
    earlier: (u8, Time),
    /// Until when turns were told, and the angle then.
    told: Option<(Time, f64)>,
}

impl GyroTurns {
    /// Nothing was heard yet.
    #[must_use]
    pub const fn new(parameters: &GyroParameters) -> Self {
        Self {
            parameters: *parameters,
            angles: Deque::new(),
            rate: 0.0,
            change: 0.0,
            period: 0.0,
            is_after_gap: false,
            earlier: (0, Time::from_micros(0)),
            told: None,
        }
    }

    /// Forgets everything.
    pub fn restart(&mut self) {
        self.angles.clear();
        self.told = None;
    }

    /// Takes a reading; gives the rate in the vehicle, rad/s, and the time since the reading before, s, if there was one.
    ///
    /// # Errors
    /// See [`GyroRefusal`].
    pub fn sample(&mut self, sample: &GyroSample) -> Result<(f64, Option<f64>), GyroRefusal> {
        let time = sample.time.offset(-self.parameters.latency);
        let last = self.angles.back().copied();
        if last.is_some_and(|(last, _)| time <= last) {
            let (count, newest) = self.earlier;
            self.earlier = (if count > 0 && time <= newest { 1 } else { count.saturating_add(1) }, time);
            if self.earlier.0 >= MOST_EARLIER {
                self.restart();
            }
            return Err(GyroRefusal::OutOfOrder);
        }
        self.earlier.0 = 0;
        let is_told = libm::fabs(sample.rate) < self.parameters.range;
        if !is_told {
            self.restart();
            return Err(GyroRefusal::Clipped);
        }
        let rate = self.parameters.factor * sample.rate;
        let before = core::mem::replace(&mut self.rate, rate);
        self.change = rate - before;
        let passed = last.map(|(last, _)| time.since(last)).filter(|passed| *passed <= LONGEST_SILENCE);
        self.is_after_gap = last.is_some() && passed.is_none();
        if passed.is_none() {
            self.restart();
        }
        self.period = passed.unwrap_or_default();
        let angle = last.zip(passed).map_or(0.0, |((_, angle), passed)| angle + 0.5 * (before + rate) * passed);
        self.remember(time, angle);
        Ok((rate, passed))
    }

    /// The newest angle stays as it is; those before it are [`SPACING`] apart.
    fn remember(&mut self, time: Time, angle: f64) {
        let mut behind = self.angles.iter().rev();
        let is_close =
            behind.next().zip(behind.next()).is_some_and(|((last, _), (before, _))| last.since(*before) < SPACING);
        if is_close {
            self.angles.pop_back();
        } else if self.angles.is_full() {
            self.angles.pop_front();
        }
        // There is room.
        let _ = self.angles.push_back((time, angle));
    }

    /// Whether nothing was heard for so long before the last reading that no turn was told.
    #[must_use]
    pub const fn is_after_gap(&self) -> bool {
        self.is_after_gap
    }

    /// The time of the last reading without its latency.
    #[must_use]
    pub fn last(&self) -> Option<Time> {
        self.angles.back().map(|(time, _)| *time)
    }

    /// The last rate, rad/s.
    #[must_use]
    pub const fn rate(&self) -> f64 {
        self.rate
    }

    /// The integral at `time`; none if nobody knows.
    fn angle_at(&self, time: Time) -> Option<f64> {
        let (newest, angle) = *self.angles.back()?;
        let ahead = time.since(newest);
        if ahead >= 0.0 {
            // What is heard late is no silence.
            return (ahead <= LONGEST_SILENCE + self.parameters.latency).then_some(angle + self.rate * ahead);
        }
        let mut next = (newest, angle);
        for &(before, angle) in self.angles.iter().rev() {
            if before <= time {
                let length = next.0.since(before);
                let share = if length > 0.0 { time.since(before) / length } else { 0.0 };
                return Some(angle + share * (next.1 - angle));
            }
            next = (before, angle);
        }
        None
    }

    /// The turn of the interval of a motion, which follows the one before. None if the gyro does not tell all of it.
    pub fn turn(&mut self, start: Time, end: Time) -> Option<GyroTurn> {
        let told = self.told.take().filter(|(until, _)| *until == start).map(|(_, angle)| angle);
        let from = told.or_else(|| self.angle_at(start));
        let to = self.angle_at(end)?;
        self.told = Some((end, to));
        Some(self.turn_of(to - from?, end, end.since(start)))
    }

    /// The turn of an interval of which the vehicle has reported nothing yet; what was told stays.
    #[must_use]
    pub fn turn_between(&self, start: Time, end: Time) -> Option<GyroTurn> {
        let angle = self.angle_at(end)? - self.angle_at(start)?;
        Some(self.turn_of(angle, end, end.since(start)))
    }

    fn turn_of(&self, angle: f64, end: Time, duration: f64) -> GyroTurn {
        let GyroParameters { noise, .. } = self.parameters;
        let between = self.change * duration;
        // When the rate has changed between two readings is even over the interval. Where it is held for longer than that, it goes on
        // changing as it did, and the turn is off by as much more as the interval is long.
        let ahead = self.last().map_or(0.0, |last| end.since(last).max(0.0));
        let held = if self.period > 0.0 { between * ahead / self.period } else { 0.0 };
        let variance = noise * noise * duration + between * between / 12.0 + held * held;
        GyroTurn { angle, duration, variance }
    }
}

impl Motion {
    /// The same motion with another turn, of which the variance is told (rad^2): the way is believed, and its chord has half of
    /// the turn.
    #[must_use]
    pub fn with_turn(&self, turn: f64, variance: f64) -> Motion {
        let Pose { x, y, theta } = self.displacement;
        let (sine, cosine) = libm::sincos(0.5 * (turn - theta));
        let displacement = Pose { x: cosine * x - sine * y, y: sine * x + cosine * y, theta: turn };
        let (by_x, by_y) = (-0.5 * displacement.y, 0.5 * displacement.x);
        let q = &self.covariance;
        let (xh, yh) = (by_x * variance, by_y * variance);
        let xy = q.m12 + by_x * yh;
        let covariance = nalgebra::Matrix3::new(q.m11 + by_x * xh, xy, xh, xy, q.m22 + by_y * yh, yh, xh, yh, variance);
        Motion { displacement, covariance, ..*self }
    }
}
