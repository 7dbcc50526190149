//! How a vehicle has moved of late, for what was measured between two samples of its odometry or a little before them.

use serde::{Deserialize, Serialize};

use super::Motion;
use crate::geometry::Pose;
use crate::measurement::Time;

/// The velocity is the mean of at least this time, s, once so much is known: samples come unevenly.
const SPAN: f64 = super::Coasting::SPAN;

/// What was measured is carried over at most this time, s.
const LONGEST: f64 = 0.32;

/// The displacement of one to two tenths of a second.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct RecentMotion {
    start: Time,
    middle: Time,
    end: Time,
    /// From `start` to `middle`.
    older: Pose,
    /// From `middle` to `end`.
    newer: Pose,
}

impl RecentMotion {
    /// A vehicle that is taken to stand at `time`.
    #[must_use]
    pub fn standing(time: Time) -> Self {
        Self { start: time, middle: time, end: time, older: Pose::default(), newer: Pose::default() }
    }

    /// Takes the motion that follows.
    pub fn add(&mut self, motion: &Motion) {
        if self.end.since(self.middle) >= SPAN {
            (self.start, self.middle, self.older) = (self.middle, self.end, self.newer);
            self.newer = Pose::default();
        }
        self.end = motion.end;
        self.newer = self.newer.compose(&motion.displacement);
    }

    /// Until when the motion is known.
    #[must_use]
    pub fn end(&self) -> Time {
        self.end
    }

    /// The pose of R at `time` in R at the end, at constant body velocity, at most 0.32 s away.
    #[must_use]
    pub fn pose_at(&self, time: Time) -> Pose {
        let duration = self.end.since(self.start);
        let away = time.since(self.end).clamp(-LONGEST, LONGEST);
        if duration > 0.0 { self.older.compose(&self.newer).fraction(away / duration) } else { Pose::default() }
    }
}
