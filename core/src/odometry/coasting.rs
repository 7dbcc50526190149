//! The motion of a vehicle whose odometry is not believed, or has not reported yet.

use serde::{Deserialize, Serialize};

use super::{Motion, OdometryNoise, Vehicle};
use crate::measurement::Time;

/// Longest time for which the uncertainty is computed, s: long after it has become useless, and before it overflows.
const LONGEST: f64 = 1e3;

/// Standard deviations of the accelerations that nobody measures.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnknownAcceleration {
    /// Forward, m/s^2.
    pub along: f64,
    /// To the left, m/s^2: zero for a vehicle that cannot move sideways.
    pub aside: f64,
    /// Of the turn, rad/s^2.
    pub turn: f64,
}

impl UnknownAcceleration {
    /// That of a vehicle.
    #[must_use]
    pub fn of(vehicle: &Vehicle, noise: &OdometryNoise) -> Self {
        let along = noise.unknown_acceleration;
        Self { along, aside: if vehicle.moves_sideways() { along } else { 0.0 }, turn: noise.unknown_turn }
    }
}

/// A vehicle that is assumed to keep its last believed velocity, though it may have braked, sped up or turned.
///
/// An unknown constant acceleration `a` gives the velocity an error of `a t` after `t` seconds. From `c` on, when the pose was known
/// last, until `t` it gives the distance an error of `a (t^2 - c^2) / 2`, and an unknown angular acceleration the heading likewise.
/// That is one error: its deviation grows, not its variance.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Coasting {
    /// The motion whose mean velocity is kept.
    believed: Motion,
    /// When the vehicle had that velocity.
    since: Time,
    /// When the pose was known last.
    known: Time,
    until: Time,
}

impl Coasting {
    /// Whoever begins to coast takes the mean velocity of about this time, s: samples come unevenly, so that one interval may hold
    /// the distance of two, and the next one none.
    pub const SPAN: f64 = 0.1;

    /// Coasting behind the last motion that was believed.
    #[must_use]
    pub const fn new(believed: Motion) -> Self {
        let end = believed.end;
        Self { believed, since: end, known: end, until: end }
    }

    /// The pose was corrected at `time`.
    pub fn correct(&mut self, time: Time) {
        self.known = time.max(self.since);
    }

    /// The pose was corrected at both ends of a motion, which tells the mean velocity between them, with that covariance of the
    /// displacement. It is taken if it is known better than the one that was kept.
    pub fn correct_velocity(&mut self, motion: &Motion, unknown: &UnknownAcceleration) {
        self.correct(motion.end);
        let duration = motion.end.since(motion.start);
        let half = 0.5 * duration;
        let kept = motion.end.since(self.since).min(LONGEST);
        let is_better = |variance: f64, acceleration: f64| {
            let (own, other) = (variance / (duration * duration), acceleration * acceleration);
            own + other * half * half < other * kept * kept
        };
        let is_better = duration > 0.0
            && is_better(motion.covariance.m11, unknown.along)
            && is_better(motion.covariance.m33, unknown.turn);
        if is_better {
            self.believed = *motion;
            self.since = motion.end.offset(-half);
            self.until = self.until.max(motion.end);
        }
    }

    /// The assumed motion since the last call, until `time`. None if that time is not later.
    pub fn to(&mut self, time: Time, unknown: &UnknownAcceleration) -> Option<Motion> {
        if time <= self.until {
            return None;
        }
        let believed = &self.believed;
        let pace = believed.end.since(believed.start);
        let share = if pace > 0.0 { time.since(self.until) / pace } else { 0.0 };
        let mut covariance = believed.covariance * share;
        let square = |time: Time| {
            let seconds = time.since(self.since).clamp(0.0, LONGEST);
            seconds * seconds
        };
        let known = square(self.known);
        // Of the distance for each unit of the acceleration.
        let variance = |time: Time| 0.25 * (square(time) - known) * (square(time) - known);
        let growth = if time > self.known { variance(time) - variance(self.until.max(self.known)) } else { 0.0 };
        covariance.m11 += unknown.along * unknown.along * growth;
        covariance.m22 += unknown.aside * unknown.aside * growth;
        covariance.m33 += unknown.turn * unknown.turn * growth;
        let motion = Motion {
            start: self.until,
            end: time,
            displacement: believed.displacement.fraction(share),
            covariance,
            distance: believed.distance * share,
        };
        self.until = time;
        Some(motion)
    }
}
