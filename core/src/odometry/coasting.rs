//! The motion of a vehicle whose odometry is not believed.

use super::{Motion, OdometryNoise};
use crate::measurement::Time;

/// Longest time for which the uncertainty is computed, s: long after it has become useless, and before it overflows.
const LONGEST: f64 = 1e3;

/// A vehicle that is assumed to keep its last believed velocity, though it may have braked, sped up or turned.
///
/// An unknown constant acceleration gives the distance a deviation of `a t^2 / 2` after `t` seconds, an unknown angular
/// acceleration the heading likewise.
#[derive(Clone, Copy, Debug)]
pub struct Coasting {
    believed: Motion,
    until: Time,
}

impl Coasting {
    /// Whoever begins to coast takes the mean velocity of this time, s: samples come unevenly, so that one interval may hold
    /// the distance of two, and the next one none.
    pub const SPAN: f64 = 0.1;

    /// Coasting behind the last motion that was believed.
    #[must_use]
    pub const fn new(believed: Motion) -> Self {
        Self { believed, until: believed.end }
    }

    /// The assumed motion since the last call, until `time`. None if that time is not later.
    pub fn to(&mut self, time: Time, noise: &OdometryNoise) -> Option<Motion> {
        if time <= self.until {
            return None;
        }
        let believed = &self.believed;
        let pace = believed.end.since(believed.start);
        let share = if pace > 0.0 { time.since(self.until) / pace } else { 0.0 };
        let mut covariance = believed.covariance * share;
        let seconds = |time: Time| time.since(believed.end).min(LONGEST);
        let fourth_power = |seconds: f64| seconds * seconds * seconds * seconds;
        let growth = 0.25 * (fourth_power(seconds(time)) - fourth_power(seconds(self.until)));
        covariance.m11 += noise.unknown_acceleration * noise.unknown_acceleration * growth;
        covariance.m33 += noise.unknown_turn * noise.unknown_turn * growth;
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
