//! How wrong a pose may be.

use serde::{Deserialize, Serialize};

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

    /// The larger one of each bound.
    #[must_use]
    pub fn or(&self, other: &Self) -> Self {
        Self { position: self.position.max(other.position), heading: self.heading.max(other.heading) }
    }

    /// The smaller one of each bound: where both hold, each of its components does.
    #[must_use]
    pub fn and(&self, other: &Self) -> Self {
        Self { position: self.position.min(other.position), heading: self.heading.min(other.heading) }
    }
}
