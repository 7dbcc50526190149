//! Everything about a vehicle that is known before it starts.

use serde::{Deserialize, Serialize};

use super::Lasers;
use crate::geometry::Pose;
use crate::integrity::separation::AssumedDeviations;
use crate::integrity::{AlertLimits, InnovationMonitorParameters};
use crate::maps::DynamicMapParameters;
use crate::measurement::Scan;
use crate::odometry::{GyroParameters, Integration, OdometerParameters, OdometryNoise, Vehicle};
use crate::sensing::ReflectorDetection;
use crate::sources::{
    AssociationParameters, Believed, FeatureParameters, MapUse, ReflectorParameters, SlamParameters, Switches,
};

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
    /// The gyro, if there is one. In a log it stands behind the header.
    #[serde(skip)]
    pub gyro: GyroParameters,
    /// Which sources correct the pose.
    pub sources: Switches,
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
    /// Whether the error of the pose is bounded by solution separation. Without it the protection level is unbounded.
    pub protection: bool,
    /// What is unknown of a vehicle in order.
    pub assumed: AssumedDeviations,
    /// What the vehicle can live with.
    pub alert_limits: AlertLimits,
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
            gyro: GyroParameters::default(),
            sources: Switches::default(),
            maps: MapUse::default(),
            reflectors: ReflectorParameters::default(),
            features: FeatureParameters::default(),
            association: AssociationParameters::default(),
            dynamic_map: DynamicMapParameters::default(),
            slam: SlamParameters::default(),
            consistency: InnovationMonitorParameters::default(),
            limits: Limits::default(),
            protection: true,
            assumed: AssumedDeviations::default(),
            alert_limits: AlertLimits::default(),
        }
    }

    /// How reflectors are to be found in a scan, if they are.
    pub(super) fn detection_in(&self, scan: &Scan) -> Option<&ReflectorDetection> {
        self.uses_reflectors().then(|| self.reflectors.detection_in(scan)).flatten()
    }

    /// Whether reflectors correct the pose.
    pub(super) const fn uses_reflectors(&self) -> bool {
        self.maps.reflectors && self.sources.reflectors
    }

    /// Whether a gyro tells the turn of each motion. A map in the state has its own biases of the odometry, and no place for
    /// those of a gyro yet.
    pub(super) const fn uses_gyro(&self) -> bool {
        self.gyro.is_fitted && self.sources.gyro && !self.maps.slam
    }

    /// What an odometer of the vehicle believes.
    #[must_use]
    pub fn odometer(&self) -> OdometerParameters {
        OdometerParameters {
            noise: self.odometry_noise,
            integration: self.integration,
            fastest: self.limits.fastest,
            longest_interval: self.limits.longest_interval(),
        }
    }

    /// What is believed of landmarks.
    pub(super) const fn believed(&self) -> Believed<'_> {
        Believed {
            maps: self.maps,
            association: &self.association,
            dynamic_deviation: self.dynamic_map.deviation,
            slam: &self.slam,
        }
    }
}

/// When the vehicle is dead reckoning, and when it is lost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Limits {
    /// Faster motions are taken as faults of the odometry, m/s.
    pub fastest: f64,
    /// Distance without a landmark after which the vehicle says that it is dead reckoning, m.
    pub dead_reckoning_from: f64,
    /// Distance without a landmark after which it is lost, m.
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
