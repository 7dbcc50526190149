//! Everything about a vehicle that is known before it starts.

use serde::{Deserialize, Serialize};

use super::Lasers;
use super::slam::SlamParameters;
use crate::geometry::Pose;
use crate::integrity::InnovationMonitorParameters;
use crate::maps::DynamicMapParameters;
use crate::measurement::Scan;
use crate::odometry::{Integration, OdometryNoise, Vehicle};
use crate::sensing::{ReflectorDetection, falko};

/// What the localiser believes of its vehicle and its sensors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameters {
    /// How the vehicle moves.
    pub vehicle: Vehicle,
    /// The lasers, and where they are mounted.
    pub lasers: Lasers,
    /// How odometry is integrated.
    pub integration: Integration,
    /// How wrong odometry may be.
    pub odometry_noise: OdometryNoise,
    /// Which maps are used.
    pub maps: MapUse,
    /// Reflectors.
    pub reflectors: ReflectorParameters,
    /// Natural features.
    pub features: FeatureParameters,
    /// Which observation belongs to which landmark.
    pub association: AssociationParameters,
    /// The map that is made while driving.
    pub dynamic_map: DynamicMapParameters,
    /// The map that is part of the filter's state.
    pub slam: SlamParameters,
    /// When the evidence is against the pose.
    pub consistency: InnovationMonitorParameters,
    /// When the vehicle is dead reckoning, and when it is lost.
    pub limits: Limits,
}

impl Parameters {
    /// Default parameters for a vehicle with one laser, at `laser` in R.
    #[must_use]
    pub fn new(vehicle: Vehicle, laser: Pose) -> Self {
        Self {
            vehicle,
            lasers: Lasers::one(laser),
            integration: Integration::default(),
            odometry_noise: OdometryNoise::default(),
            maps: MapUse::default(),
            reflectors: ReflectorParameters::default(),
            features: FeatureParameters::default(),
            association: AssociationParameters::default(),
            dynamic_map: DynamicMapParameters::default(),
            slam: SlamParameters::default(),
            consistency: InnovationMonitorParameters::default(),
            limits: Limits::default(),
        }
    }

    /// How reflectors are to be found in a scan, if they are.
    pub(super) fn detection_in(&self, scan: &Scan) -> Option<&ReflectorDetection> {
        let can_tell = self.maps.reflectors && !scan.intensities.is_empty();
        self.reflectors.detection.as_ref().filter(|_| can_tell)
    }
}

/// Which maps correct the pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MapUse {
    /// The fixed map of reflectors.
    pub reflectors: bool,
    /// The fixed map of natural features.
    pub features: bool,
    /// The dynamic map of natural features (Algorithm 1 of K).
    pub dynamic: bool,
    /// Landmarks, calibration and past poses in the state of the filter; the dynamic map is then not used.
    pub slam: bool,
}

impl Default for MapUse {
    fn default() -> Self {
        Self { reflectors: true, features: true, dynamic: false, slam: false }
    }
}

/// How reflectors are seen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReflectorParameters {
    /// Standard deviation of the distance, m.
    pub range_deviation: f64,
    /// Standard deviation of the direction, rad.
    pub bearing_deviation: f64,
    /// How they are found in scans that report the strength of returns; None if the sensor finds them itself.
    pub detection: Option<ReflectorDetection>,
}

impl Default for ReflectorParameters {
    fn default() -> Self {
        Self { range_deviation: 0.01, bearing_deviation: 1e-3, detection: None }
    }
}

/// How natural features are seen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FeatureParameters {
    /// How they are found.
    pub detector: falko::Parameters,
    /// Nearest range that counts, m.
    pub nearest: f32,
    /// Farthest range that counts, m.
    pub farthest: f32,
    /// Standard deviation that is added to what the detector states, along each axis, m.
    pub added_deviation: f64,
    /// Whether the scan is corrected for the motion of the vehicle within the revolution.
    pub motion_correction: bool,
}

impl Default for FeatureParameters {
    fn default() -> Self {
        Self {
            detector: falko::Parameters::default(),
            nearest: 0.5,
            farthest: 30.0,
            added_deviation: 0.01,
            motion_correction: true,
        }
    }
}

/// Which observation belongs to which landmark.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AssociationParameters {
    /// Reflectors further than this from where one was seen are not considered, m.
    pub reflector_radius: f64,
    /// The same for natural features, m.
    pub feature_radius: f64,
    /// Largest squared Mahalanobis distance, chi-square with two degrees of freedom.
    pub gate: f64,
    /// By how much the second best landmark must be worse, in squared Mahalanobis distance.
    pub margin: f64,
    /// How many observations in a row share the error of a landmark's place in the map. The filter takes errors as
    /// independent; this multiplies the variance of the landmark, so that seeing one landmark often does not make its
    /// place certain.
    pub shared_map_error: f64,
}

impl Default for AssociationParameters {
    /// The gate lets 99.7 per cent of the right ones pass.
    fn default() -> Self {
        Self { reflector_radius: 1.5, feature_radius: 0.3, gate: 11.83, margin: 9.0, shared_map_error: 20.0 }
    }
}

/// When the vehicle is dead reckoning, and when it is lost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Limits {
    /// Faster motions are taken as faults of the odometry, m/s.
    pub fastest: f64,
    /// Way without a landmark after which the vehicle says that it is dead reckoning, m.
    pub dead_reckoning_from: f64,
    /// Way without a landmark after which it is lost, m.
    pub lost_after: f64,
    /// Standard deviation of the position above which it is lost, m.
    pub largest_position_deviation: f64,
    /// Standard deviation of the heading above which it is lost, rad.
    pub largest_heading_deviation: f64,
    /// How far ahead of the odometry a measurement may be, s. Two samples of the odometry may be 2.5 times as far apart,
    /// and 0.25 s in any case.
    pub longest_extrapolation: f64,
}

impl Limits {
    /// Longest time between two samples of the odometry, s: more than that is a silence, and no motion is made of it.
    #[must_use]
    pub fn longest_interval(&self) -> f64 {
        (2.5 * self.longest_extrapolation).max(0.25)
    }
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            fastest: 5.0,
            dead_reckoning_from: 0.5,
            lost_after: 50.0,
            largest_position_deviation: 1.0,
            largest_heading_deviation: 0.2,
            longest_extrapolation: 0.1,
        }
    }
}
