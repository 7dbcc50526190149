//! The floor, which tilts the vehicle, and with it the laser on its mast.

use serde::{Deserialize, Serialize};

/// A floor of smooth waves. A vehicle stands on it in its tangent plane.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FloorOptions {
    /// Standard deviation of its height, m; 0 for a plane.
    pub deviation: f64,
    /// Distance over which the height is correlated, m.
    pub length: f64,
    /// Height of the laser above it, m.
    pub laser_height: f64,
}

impl Default for FloorOptions {
    fn default() -> Self {
        Self { deviation: 0.0, length: 3.0, laser_height: 2.5 }
    }
}
