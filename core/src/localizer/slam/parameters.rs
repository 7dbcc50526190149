//! How the map that is part of the filter's state lives.

use serde::{Deserialize, Serialize};

use crate::filter::{BiasDeviations, BiasWalk};
use crate::sensing::{SurfaceAlignmentParameters, SurfaceParameters};

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
    /// RigidFit to key scans; none if only features count.
    pub key_scans: Option<KeyScanParameters>,
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
            key_scans: Some(KeyScanParameters::default()),
        }
    }
}

/// How scans are aligned to key scans.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct KeyScanParameters {
    /// Way after which a scan becomes a key scan, m.
    pub spacing: f64,
    /// Turn after which it does, rad.
    pub turn: f64,
    /// How a key scan's surfaces are found.
    pub surfaces: SurfaceParameters,
    /// How scans are aligned to them.
    pub alignment: SurfaceAlignmentParameters,
    /// Least share of a scan's returns that must lie on a key scan's surfaces.
    pub least_share: f64,
    /// By what the covariance of an alignment is multiplied that takes returns as independent.
    pub inflation: f64,
    /// Standard deviation that is added along each axis, m.
    pub position_floor: f64,
    /// The same for the heading, rad.
    pub heading_floor: f64,
    /// Largest squared Mahalanobis distance from what is expected, chi-square with three degrees of freedom.
    pub gate: f64,
}

impl Default for KeyScanParameters {
    /// Inflation and floors of the project's feasibility study; the gate lets 99.9 per cent of the right ones pass.
    fn default() -> Self {
        Self {
            spacing: 1.5,
            turn: 0.35,
            surfaces: SurfaceParameters::default(),
            alignment: SurfaceAlignmentParameters::default(),
            least_share: 0.25,
            inflation: 12.0,
            position_floor: 0.5e-3,
            heading_floor: 0.9e-4,
            gate: 16.3,
        }
    }
}
