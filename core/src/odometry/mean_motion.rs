//! How fast the vehicle goes, in the mean of about a tenth of a second.
//!
//! One report holds a tick more or less, and a time that is a little off: at a thousand reports a second its velocity is hardly known.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::{Coasting, Motion};
use crate::geometry::{Pose, Twist};
use crate::measurement::Time;

/// A part that lasts so long, s, is whole; one that lasts half as long tells enough alone: what is older tells of another speed.
const SPAN: f64 = Coasting::SPAN;

/// Body velocities of so much time, added in R.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Part {
    moved: Vector3<f64>,
    covariance: Matrix3<f64>,
    distance: f64,
    seconds: f64,
}

impl Part {
    const NONE: Self = Self {
        moved: Vector3::new(0.0, 0.0, 0.0),
        covariance: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        distance: 0.0,
        seconds: 0.0,
    };

    fn and(&self, other: &Self) -> Self {
        Self {
            moved: self.moved + other.moved,
            covariance: self.covariance + other.covariance,
            distance: self.distance + other.distance,
            seconds: self.seconds + other.seconds,
        }
    }
}

/// The mean over the motions of the last twentieth to seventh of a second.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct MeanMotion {
    older: Part,
    newer: Part,
    end: Time,
}

impl MeanMotion {
    /// A vehicle that has not moved.
    pub const NONE: Self = Self { older: Part::NONE, newer: Part::NONE, end: Time::from_micros(0) };

    /// A vehicle of which nothing is known before `time`.
    #[must_use]
    pub const fn from(time: Time) -> Self {
        Self { end: time, ..Self::NONE }
    }

    /// Takes the next motion.
    pub fn add(&mut self, motion: &Motion) {
        if self.newer.seconds >= SPAN {
            (self.older, self.newer) = (self.newer, Part::NONE);
        }
        let Motion { displacement: Pose { x, y, theta }, covariance, distance, .. } = motion;
        // The logarithm of the displacement, up to the fourth power of its turn.
        let (along, across) = (1.0 - theta * theta / 12.0, 0.5 * theta);
        self.newer = self.newer.and(&Part {
            moved: Vector3::new(along * x + across * y, along * y - across * x, *theta),
            covariance: *covariance,
            distance: *distance,
            seconds: motion.end.since(motion.start),
        });
        self.end = motion.end;
    }

    fn mean(&self) -> Part {
        if self.newer.seconds >= 0.5 * SPAN { self.newer } else { self.older.and(&self.newer) }
    }

    /// In R: m/s, m/s and rad/s.
    #[must_use]
    pub fn velocity(&self) -> Vector3<f64> {
        let Part { moved, seconds, .. } = self.mean();
        moved / seconds.max(1e-3)
    }

    /// The motion at that velocity for the time over which it is the mean, until the end of the last one.
    #[must_use]
    pub fn motion(&self) -> Motion {
        let Part { moved, covariance, distance, seconds } = self.mean();
        let displacement = Pose::exp(&Twist { x: moved.x, y: moved.y, theta: moved.z });
        Motion { start: self.end.offset(-seconds), end: self.end, displacement, covariance, distance }
    }
}
