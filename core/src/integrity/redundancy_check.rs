//! Whether the wheels of a vehicle that has more of them than it needs fit each other.
//!
//! What does not fit is summed over some way and held against its deviation: the slip that the wheels have shown on the way behind,
//! which is not more than that stated, and what lasts of the errors of wheels and steering. More than that is a wheel that slips. The sum has a sign, so that what wanders to and
//! fro is not taken for what goes one way.

use serde::{Deserialize, Serialize};

use crate::measurement::Time;
use crate::odometry::Motion;

/// Way over which what does not fit is summed, m.
const WINDOW: f64 = 0.3;
/// So many sums, each of which begins behind the one before by its part of the way.
const WINDOWS: usize = 8;
/// A sum of more deviations is none of a vehicle in order.
const GATE: f64 = 5.6;
/// The slip of wheels in order is learnt over so much of the way, m, from that stated as if it had been seen for a while, m; it is not
/// less than this share of it.
const LEARNT_OVER: f64 = 10.0;
const STATED_FOR: f64 = 1.0;
const LEAST_SHARE: f64 = 0.5;
/// How long, s, what was found is told.
const TOLD_FOR: f64 = 1.0;

/// What was summed since a place.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Window {
    slip: f64,
    way: f64,
}

impl Window {
    const EMPTY: Self = Self { slip: 0.0, way: 0.0 };
}

/// What a vehicle in order does not exceed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelErrors {
    /// Standard deviation of the slip of a wheel, m for a square root of a metre.
    pub slip: f64,
    /// Variance of what lasts: square of a share of the way.
    pub lasting: f64,
    /// What the rounding of all readings to ticks makes of a sum at most, m.
    pub step: f64,
}

/// The sums, and until when a slip is told.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RedundancyCheck {
    windows: [Window; WINDOWS],
    /// The window that begins next, and the way since the last one began, m.
    next: usize,
    since: f64,
    /// Sum of squares of what did not fit, and its way, over the last metres.
    learnt: (f64, f64),
    slips_until: Option<Time>,
}

impl RedundancyCheck {
    /// A check that has seen nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self { windows: [Window::EMPTY; WINDOWS], next: 0, since: 0.0, learnt: (0.0, 0.0), slips_until: None }
    }

    /// Forgets the way behind.
    pub fn clear(&mut self) {
        self.windows = [Window::EMPTY; WINDOWS];
    }

    /// Takes a motion, and what does not fit of it, m ([`crate::odometry::Step::slip`]).
    pub fn travel(&mut self, motion: &Motion, slip: f64, errors: &WheelErrors) {
        if self.since >= WINDOW / WINDOWS as f64 {
            // The oldest one is over.
            if let Some(oldest) = self.windows.get_mut(self.next) {
                *oldest = Window::EMPTY;
            }
            (self.next, self.since) = (self.next.wrapping_add(1) % WINDOWS, 0.0);
        }
        self.since += motion.distance;
        let variance = self.learn(motion.distance, slip, errors.slip * errors.slip);
        for window in &mut self.windows {
            window.slip += slip;
            window.way += motion.distance;
            let expected = (variance + errors.lasting * window.way) * window.way + errors.step * errors.step;
            if window.slip * window.slip > GATE * GATE * expected {
                self.slips_until = Some(motion.end.offset(TOLD_FOR));
            }
        }
    }

    /// What wheels in order slip, m^2 for a metre, where `stated` is the most.
    fn learn(&mut self, distance: f64, slip: f64, stated: f64) -> f64 {
        let (squares, way) = self.learnt;
        let kept = 1.0 - (distance / LEARNT_OVER).min(1.0);
        self.learnt = (kept * squares + slip * slip, kept * way + distance);
        let shown = (squares + stated * STATED_FOR) / (way + STATED_FOR);
        // `clamp` panics where its bounds contradict each other.
        shown.max(LEAST_SHARE * LEAST_SHARE * stated).min(stated)
    }

    /// Whether a wheel slips.
    #[must_use]
    pub fn slips(&self, now: Time) -> bool {
        self.slips_until.is_some_and(|until| now <= until)
    }
}

impl Default for RedundancyCheck {
    fn default() -> Self {
        Self::new()
    }
}
