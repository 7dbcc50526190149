//! Whether the wheels have led as far as landmarks say.
//!
//! Where wheels do not slip, what each revolution of landmarks puts right is independent of the one before, and its variance is that
//! by which the covariance of the pose has shrunk (innovations of a Kalman filter are white). So the sum over a short way has the sum of
//! the variances. A wheel that slips makes the same error again and again: along the way, or in the heading, or both. What is large, of
//! one sign, and a share of the way that no calibration leaves is slip.

use heapless::Deque;
use serde::{Deserialize, Serialize};

use super::Estimate;
use crate::measurement::Time;

/// Parts of the way that are remembered, and the length of each at least, m.
const PARTS: usize = 4;
const PART: f64 = 0.06;
/// A sum of parts is not longer than this, m.
const WINDOW: f64 = 0.5;
/// After a longer way without a correction nothing is known of the way before, m.
const LONGEST_GAP: f64 = 0.3;
/// What calibration leaves: a share of the way, and a turn for each metre, rad/m. What goes beyond it by more deviations is none of a
/// vehicle in order.
const LASTING: (f64, f64) = (0.02, 0.01);
const GATE: f64 = 4.4;
/// Less than this share of the way, or this turn for each metre, rad/m, is no slip but an odometry of another scale.
const LEAST_SLIP: (f64, f64) = (0.06, 0.03);
/// How long, s, what was found is told.
const TOLD_FOR: f64 = 1.0;
/// What lasts longer, s, is no slip: the odometry is of another scale.
const LONGEST_SLIP: f64 = 3.0;
/// Landmarks of a fixed map that an event must have used to tell anything.
pub const LEAST: usize = 2;

/// What was put right on a part of the way: m and rad, and their variances.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Part {
    way: f64,
    along: f64,
    heading: f64,
    along_variance: f64,
    heading_variance: f64,
}

impl Part {
    fn and(&self, other: &Self) -> Self {
        Self {
            way: self.way + other.way,
            along: self.along + other.along,
            heading: self.heading + other.heading,
            along_variance: self.along_variance + other.along_variance,
            heading_variance: self.heading_variance + other.heading_variance,
        }
    }

    /// Whether what was put right is more than chance and calibration leave.
    fn is_slip(&self) -> [bool; 2] {
        let is_beyond = |value: f64, variance: f64, lasting: f64, least: f64| {
            let excess = libm::fabs(value) - lasting * self.way;
            libm::fabs(value) > least * self.way && excess > GATE * libm::sqrt(variance)
        };
        [
            is_beyond(self.along, self.along_variance, LASTING.0, LEAST_SLIP.0),
            is_beyond(self.heading, self.heading_variance, LASTING.1, LEAST_SLIP.1),
        ]
    }

    fn has_signs_of(&self, other: &Self) -> [bool; 2] {
        [self.along * other.along > 0.0, self.heading * other.heading > 0.0]
    }
}

/// The last parts of the way, and until when a slip is told.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct TractionCheck {
    parts: Deque<Part, PARTS>,
    /// Since when and until when a slip is told.
    slips: Option<(Time, Time)>,
}

impl TractionCheck {
    /// A check that has seen nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self { parts: Deque::new(), slips: None }
    }

    /// Forgets the way behind.
    pub fn clear(&mut self) {
        self.parts.clear();
    }

    /// Takes what landmarks have put right at `now`: the estimate before and after it.
    pub fn correct(&mut self, before: &Estimate, after: &Estimate, now: Time) {
        if !before.is_sure || before.distance > LONGEST_GAP {
            return self.clear();
        }
        let correction = before.correction_to(after);
        let (sine, cosine) = libm::sincos(after.pose.theta);
        let shrunk = before.covariance - after.covariance;
        let along_variance = cosine * cosine * shrunk.m11 + 2.0 * sine * cosine * shrunk.m12 + sine * sine * shrunk.m22;
        let part = Part {
            way: before.distance,
            along: correction.x,
            heading: correction.theta,
            along_variance: along_variance.max(0.0),
            heading_variance: shrunk.m33.max(0.0),
        };
        match self.parts.back_mut().filter(|newest| newest.way < PART) {
            Some(newest) => *newest = newest.and(&part),
            None => {
                if self.parts.is_full() {
                    self.parts.pop_front();
                }
                // There is room.
                let _ = self.parts.push_back(part);
            }
        }
        if self.is_slip() {
            let since = self.slips.filter(|(_, until)| now <= *until).map_or(now, |(since, _)| since);
            self.slips = Some((since, now.offset(TOLD_FOR)));
        }
    }

    /// Whether the newest parts together are slip: two of them at least, all of one sign.
    fn is_slip(&self) -> bool {
        let mut parts = self.parts.iter().rev();
        let Some(mut sum) = parts.next().copied() else { return false };
        let mut of_one_sign = [true; 2];
        for part in parts {
            let [along, heading] = sum.has_signs_of(part);
            of_one_sign = [of_one_sign[0] && along, of_one_sign[1] && heading];
            sum = sum.and(part);
            if sum.way > WINDOW {
                return false;
            }
            if sum.is_slip().into_iter().zip(of_one_sign).any(|(is_slip, is_one)| is_slip && is_one) {
                return true;
            }
        }
        false
    }

    /// Whether a wheel slips.
    #[must_use]
    pub fn slips(&self, now: Time) -> bool {
        self.slips.is_some_and(|(since, until)| now <= until && now.since(since) <= LONGEST_SLIP)
    }
}

impl Default for TractionCheck {
    fn default() -> Self {
        Self::new()
    }
}
