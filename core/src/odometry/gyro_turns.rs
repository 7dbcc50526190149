//! Rates of a gyro into the turn of each motion.

use heapless::Deque;

use super::{GyroErrors, GyroParameters, Motion};
use crate::geometry::Pose;
use crate::measurement::{GyroSample, Time};

/// Samples that are remembered: what the wheels say may come later than what the gyro says by so many of its samples.
const REMEMBERED: usize = 16;
/// A gyro that has said nothing for so long, s, tells no turn.
const LONGEST_SILENCE: f64 = 0.05;

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
#[derive(Clone, Debug)]
pub struct GyroTurns {
    parameters: GyroParameters,
    /// Times and angles, rad.
    angles: Deque<(Time, f64), REMEMBERED>,
    rate: f64,
    /// By how much the last two rates differ, rad/s.
    change: f64,
    /// Until when turns were told, and the angle then.
    told: Option<(Time, f64)>,
}

impl GyroTurns {
    /// Nothing was heard yet.
    #[must_use]
    pub const fn new(parameters: &GyroParameters) -> Self {
        Self { parameters: *parameters, angles: Deque::new(), rate: 0.0, change: 0.0, told: None }
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
            return Err(GyroRefusal::OutOfOrder);
        }
        let is_told = libm::fabs(sample.rate) < self.parameters.range;
        if !is_told {
            self.restart();
            return Err(GyroRefusal::Clipped);
        }
        let rate = self.parameters.factor * sample.rate;
        let before = core::mem::replace(&mut self.rate, rate);
        self.change = rate - before;
        let passed = last.map(|(last, _)| time.since(last)).filter(|passed| *passed <= LONGEST_SILENCE);
        if passed.is_none() {
            self.restart();
        }
        let angle = last.zip(passed).map_or(0.0, |((_, angle), passed)| angle + 0.5 * (before + rate) * passed);
        if self.angles.is_full() {
            self.angles.pop_front();
        }
        // There is room.
        let _ = self.angles.push_back((time, angle));
        Ok((rate, passed))
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
            return (ahead <= LONGEST_SILENCE).then_some(angle + self.rate * ahead);
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
        let duration = end.since(start);
        let GyroParameters { noise, .. } = self.parameters;
        let between = self.change * duration;
        // When the rate has changed between two readings is even over the interval.
        let variance = noise * noise * duration + between * between / 12.0;
        Some(GyroTurn { angle: to - from?, duration, variance })
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
