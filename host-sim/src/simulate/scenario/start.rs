//! The start pose that the localiser is given, and who walks about.

use serde::{Deserialize, Serialize};

use crate::simulate::people::PersonShape;

/// The start pose that the localiser is given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StartOptions {
    /// Whether there is one.
    pub given: bool,
    /// Standard deviation along each axis, m, true and stated.
    pub position_deviation: f64,
    /// Standard deviation of the heading, true and stated.
    pub heading_deviation_deg: f64,
}

impl Default for StartOptions {
    fn default() -> Self {
        Self { given: true, position_deviation: 0.005, heading_deviation_deg: 0.03 }
    }
}

/// Somebody who walks about.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PersonOptions {
    /// Corners of the closed way, x and y in W, m.
    pub way: Vec<[f64; 2]>,
    /// Speed, m/s.
    #[serde(default = "PersonOptions::standard_speed")]
    pub speed: f64,
    /// Share of the way that is behind at the start, 0 to 1; the seed chooses if absent.
    pub phase: Option<f64>,
    /// What the laser sees.
    #[serde(default)]
    pub shape: PersonShape,
}

impl PersonOptions {
    fn standard_speed() -> f64 {
        1.2
    }
}
