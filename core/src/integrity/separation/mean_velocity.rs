//! How fast the vehicle goes, in the mean of about a tenth of a second.
//!
//! The velocity of one sample has its noise. A solution whose clock is free would take that for changes of speed which show no error of the clock,
//! and so learn at constant speed that there is none.

use nalgebra::Vector3;

use crate::odometry::{Coasting, Motion};

/// A part that lasts so long, s, is whole; one that lasts half as long tells enough alone: what is older tells of another speed.
const SPAN: f64 = Coasting::SPAN;

/// The displacements of so much time, added in R.
#[derive(Clone, Copy, Debug)]
struct Part {
    moved: Vector3<f64>,
    seconds: f64,
}

impl Part {
    const NONE: Self = Self { moved: Vector3::new(0.0, 0.0, 0.0), seconds: 0.0 };
}

/// The mean over the last motions.
#[derive(Clone, Copy, Debug)]
pub struct MeanVelocity {
    older: Part,
    newer: Part,
}

impl MeanVelocity {
    /// A vehicle that has not moved.
    pub const NONE: Self = Self { older: Part::NONE, newer: Part::NONE };

    /// Takes the next motion.
    pub fn add(&mut self, motion: &Motion) {
        if self.newer.seconds >= SPAN {
            (self.older, self.newer) = (self.newer, Part::NONE);
        }
        let displacement = &motion.displacement;
        self.newer.moved += Vector3::new(displacement.x, displacement.y, displacement.theta);
        self.newer.seconds += motion.end.since(motion.start);
    }

    /// In R: m/s, m/s and rad/s.
    #[must_use]
    pub fn velocity(&self) -> Vector3<f64> {
        let Part { moved, seconds } = self.newer;
        if seconds >= 0.5 * SPAN {
            return moved / seconds;
        }
        (self.older.moved + moved) / (self.older.seconds + seconds).max(1e-3)
    }
}
