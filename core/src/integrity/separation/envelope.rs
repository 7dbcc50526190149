//! The largest of the bounds of many solutions, also after a motion, without all of them.
//!
//! A bound is what lies between a solution and the pose, and so many deviations of the solution. A motion adds the same variance to all
//! solutions: the bound of one that knows the pose well grows most. So those are kept that no other one exceeds, now and from now on.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::sensor_information::not_negative;
use super::solution::Drift;
use crate::state::ProtectionLevel;

/// Bounds of either kind that are kept; if there are more, one stands for two.
const KEPT: usize = 8;

/// How far a pose may be off if one solution is right.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SolutionBound {
    /// Of the position, m.
    pub position: Bound,
    /// Of the heading, rad.
    pub heading: Bound,
}

impl SolutionBound {
    /// Nothing is bounded.
    pub const UNBOUNDED: Self = Self::fixed(&ProtectionLevel::UNBOUNDED);

    /// A bound that no motion changes.
    #[must_use]
    pub const fn fixed(level: &ProtectionLevel) -> Self {
        Self {
            position: Bound { apart: level.position, ..Bound::NONE },
            heading: Bound { apart: level.heading, ..Bound::NONE },
        }
    }

    /// As it is.
    #[must_use]
    pub fn level(&self) -> ProtectionLevel {
        self.after(&Growth::NONE)
    }

    /// Whether the pose is further from the solution than its bound allows.
    #[must_use]
    pub fn is_exceeded(&self) -> bool {
        [&self.position, &self.heading]
            .into_iter()
            .any(|bound| bound.apart > bound.factor * libm::sqrt(not_negative(bound.variance)))
    }

    /// After a motion.
    #[must_use]
    pub fn after(&self, growth: &Growth) -> ProtectionLevel {
        ProtectionLevel { position: self.position.after(growth.position), heading: self.heading.after(growth.heading) }
    }

    /// After one on which the solution knows what leads the pose away.
    #[must_use]
    pub fn after_drift(&self, growth: &Growth, drift: &Drift) -> ProtectionLevel {
        let (by_position, by_heading) = drift.expected;
        let position = self.position.after(growth.position) + self.position.factor * drift.deviation;
        let heading = self.heading.after(growth.heading + drift.heading_variance);
        ProtectionLevel { position: position + by_position, heading: heading + by_heading }
    }
}

/// One component of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bound {
    /// What lies between the solution and the pose.
    pub apart: f64,
    /// Variance of the solution.
    pub variance: f64,
    /// How many deviations of it are added.
    pub factor: f64,
}

impl Bound {
    const NONE: Self = Self { apart: 0.0, variance: 0.0, factor: 0.0 };

    /// Whether it bounds anything.
    #[must_use]
    pub const fn is_finite(&self) -> bool {
        self.apart.is_finite() && self.variance.is_finite() && self.factor.is_finite()
    }

    fn after(&self, added: f64) -> f64 {
        self.apart + self.factor * libm::sqrt(not_negative(self.variance + added))
    }
}

/// A bound, and what comparing it takes.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Kept {
    bound: Bound,
    /// What it is now.
    value: f64,
    /// Square of the factor.
    square: f64,
}

impl Kept {
    fn new(bound: Bound) -> Self {
        Self { bound, value: bound.after(0.0), square: bound.factor * bound.factor }
    }

    /// Whether it is no less than another one, whatever variance is added: it is no less now, and never grows more slowly.
    fn exceeds(&self, other: &Self) -> bool {
        self.value >= other.value
            && self.square >= other.square
            && self.square * other.bound.variance >= other.square * self.bound.variance
    }

    /// One that exceeds both.
    fn or(&self, other: &Self) -> Self {
        let factor = self.bound.factor.max(other.bound.factor);
        let variance = self.bound.variance.min(other.bound.variance);
        let value = self.value.max(other.value);
        Self {
            bound: Bound { apart: value - factor * libm::sqrt(variance), variance, factor },
            value,
            square: factor * factor,
        }
    }

    /// How little one stands for both.
    fn unlike(&self, other: &Self) -> f64 {
        let deviations = |one: &Self| one.value - one.bound.apart;
        libm::fabs(self.value - other.value) + libm::fabs(deviations(self) - deviations(other))
    }
}

/// What a motion adds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Growth {
    /// Variance of the position, m^2.
    pub position: f64,
    /// Variance of the heading, rad^2.
    pub heading: f64,
}

impl Growth {
    /// No motion.
    pub const NONE: Self = Self { position: 0.0, heading: 0.0 };
}

/// The largest of the bounds of solutions to which a motion adds the same.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Envelope {
    positions: Vec<Kept, KEPT>,
    headings: Vec<Kept, KEPT>,
}

impl Envelope {
    /// Of no solution.
    #[must_use]
    pub const fn new() -> Self {
        Self { positions: Vec::new(), headings: Vec::new() }
    }

    /// Takes the bound of one more solution.
    pub fn add(&mut self, bound: &SolutionBound) {
        keep(&mut self.positions, &bound.position);
        keep(&mut self.headings, &bound.heading);
    }

    /// The largest after a motion.
    #[must_use]
    pub fn after(&self, growth: &Growth) -> ProtectionLevel {
        ProtectionLevel {
            position: largest(&self.positions, growth.position),
            heading: largest(&self.headings, growth.heading),
        }
    }
}

impl Default for Envelope {
    fn default() -> Self {
        Self::new()
    }
}

/// The largest with so much more variance. None is less than now, nor grows by more than a solution that knew the pose exactly.
fn largest(kept: &[Kept], added: f64) -> f64 {
    let deviation = libm::sqrt(added);
    let now = kept.iter().map(|one| one.value).fold(0.0, f64::max);
    kept.iter().fold(now, |largest, one| {
        let is_less = one.value + one.bound.factor * deviation <= largest;
        if is_less { largest } else { largest.max(one.bound.after(added)) }
    })
}

fn keep(kept: &mut Vec<Kept, KEPT>, bound: &Bound) {
    let bound = Kept::new(*bound);
    if kept.iter().any(|one| one.exceeds(&bound)) {
        return;
    }
    kept.retain(|one| !bound.exceeds(one));
    if kept.is_full() {
        // One stands for it and for the one that is most like it.
        let nearest = kept.iter_mut().min_by(|a, b| a.unlike(&bound).total_cmp(&b.unlike(&bound)));
        if let Some(one) = nearest {
            *one = one.or(&bound);
        }
        return;
    }
    // There is room.
    let _ = kept.push(bound);
}
