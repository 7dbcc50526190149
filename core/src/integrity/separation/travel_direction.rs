//! In which direction a vehicle moves that can move sideways: what its odometry does wrongly all the time, it does in that direction.
//!
//! Wheels that are too large make an error of the distance and a turn that depend on the direction of travel (one wheel of three in a
//! circle does nothing to a vehicle that drives along its axle). A turn for each metre is a vector of the body, of which a direction
//! shows its part along itself: after a change of the direction by `d` the part known is `cos d` of it, and the rest was never seen.

use serde::{Deserialize, Serialize};

use crate::geometry::Pose;

/// A direction is known behind so much, m.
const KNOWN_AFTER: f64 = 0.05;
/// Cosine of a change that counts, 0.11 rad: four deviations of the direction behind 5 cm, by a slip of 6 mm for a root of a metre.
const SAME: f64 = 0.994;

/// The direction, a unit vector in R; backward along it is the same one.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct TravelDirection {
    axis: (f64, f64),
    moved: (f64, f64),
}

/// The translation of an arc, m.
fn translation(displacement: &Pose) -> (f64, f64) {
    let Pose { x, y, theta } = *displacement;
    (x + 0.5 * theta * y, y - 0.5 * theta * x)
}

impl TravelDirection {
    /// Forward.
    pub const FORWARD: Self = Self { axis: (1.0, 0.0), moved: (0.0, 0.0) };

    /// Length of a displacement, m: negative backward along the direction.
    #[must_use]
    pub fn length_of(&self, displacement: &Pose) -> f64 {
        let (x, y) = translation(displacement);
        let length = libm::hypot(x, y);
        if x * self.axis.0 + y * self.axis.1 < 0.0 { -length } else { length }
    }

    /// Goes on by a displacement. The cosine of a change of the direction, if it has changed.
    pub fn go_on(&mut self, displacement: &Pose) -> Option<f64> {
        let (x, y) = translation(displacement);
        self.moved = (self.moved.0 + x, self.moved.1 + y);
        let (x, y) = self.moved;
        let length = libm::hypot(x, y);
        if length < KNOWN_AFTER {
            return None;
        }
        self.moved = (0.0, 0.0);
        let cosine = (x * self.axis.0 + y * self.axis.1) / length;
        if libm::fabs(cosine) >= SAME {
            return None;
        }
        let sign = if cosine < 0.0 { -1.0 } else { 1.0 };
        self.axis = (sign * x / length, sign * y / length);
        Some(libm::fabs(cosine))
    }
}
