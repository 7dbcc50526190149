//! How wrong a pose may be.

use serde::{Deserialize, Serialize};

use super::separation::FAULT_FREE;

/// Bounds that the errors of a pose exceed with a small probability (the protection levels of satellite navigation,
/// RTCA DO-229, appendix J).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProtectionLevel {
    /// Of the position, m.
    pub position: f64,
    /// Of the heading, rad.
    pub heading: f64,
}

impl ProtectionLevel {
    /// No error is possible.
    pub const NONE: Self = Self { position: 0.0, heading: 0.0 };
    /// Any error is.
    pub const UNBOUNDED: Self = Self { position: 1e9, heading: 1e9 };

    /// That of a pose with this covariance in W (xx, xy, yy, x heading, y heading, heading; m and rad), if nothing is wrong with
    /// vehicle, sensors and map, and if these have no errors that last.
    #[must_use]
    pub fn fault_free(covariance: &[f64; 6]) -> Self {
        let [xx, xy, yy, _, _, heading] = covariance;
        let worst = 0.5 * (xx + yy) + libm::hypot(0.5 * (xx - yy), *xy);
        Self {
            position: FAULT_FREE.position * libm::sqrt(worst.max(0.0)),
            heading: FAULT_FREE.heading * libm::sqrt(heading.max(0.0)),
        }
    }

    /// The larger one of each bound.
    #[must_use]
    pub fn or(&self, other: &Self) -> Self {
        Self { position: self.position.max(other.position), heading: self.heading.max(other.heading) }
    }
}
