//! How the map that is part of the filter's state lives.

use serde::{Deserialize, Serialize};

use crate::filter::{BiasDeviations, BiasWalk};

use super::key_scans::KeyScanParameters;

/// How the pose, the calibration and the landmarks that are found while driving are estimated together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SlamParameters {
    /// How wrong the calibration may be.
    pub biases: BiasDeviations,
    /// How fast it changes.
    pub bias_walk: BiasWalk,
    /// Largest angle between the orientations of a landmark and of what is taken for it, rad.
    pub orientation_tolerance: f32,
    /// A feature nearer than this to a landmark of its kind, m, is no new landmark.
    pub least_distance: f64,
    /// A landmark counts as confirmed when it has been seen that often.
    pub confirmed_hits: u16,
    /// A landmark that is not confirmed goes when it has not been seen for that many scans.
    pub patience: u16,
    /// Scans that are used at one place; what more there are would repeat the same errors.
    pub scans_a_place: u16,
    /// A vehicle that has moved by less than this is at the same place, m.
    pub place_size: f64,
    /// The same for its heading, rad.
    pub place_turn: f64,
    /// Alignment to key scans.
    pub key_scans: KeyScanParameters,
}

impl Default for SlamParameters {
    fn default() -> Self {
        Self {
            biases: BiasDeviations::default(),
            bias_walk: BiasWalk::default(),
            orientation_tolerance: 0.6,
            least_distance: 0.08,
            confirmed_hits: 3,
            patience: 3,
            scans_a_place: 8,
            place_size: 0.01,
            place_turn: 1e-3,
            key_scans: KeyScanParameters::default(),
        }
    }
}
