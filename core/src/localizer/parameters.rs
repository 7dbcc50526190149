//! Everything about a vehicle that is known before it starts.

use serde::{Deserialize, Serialize};

use crate::geometry::Pose;
use crate::odometry::Vehicle;

/// What the localiser believes of its vehicle and its sensors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameters {
    /// How the vehicle moves.
    pub vehicle: Vehicle,
    /// Pose of S in R (K: l).
    pub laser: Pose,
}
