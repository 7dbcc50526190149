//! Between what the numbers of the parameters must lie that no setting changes.

use super::Parameters;
use super::bounds::{Bound, SMALL, TURN};
use crate::odometry::Vehicle;

const fn bound(leaf: &'static str, least: f64, most: f64, get: fn(&Parameters) -> Option<f64>) -> Bound {
    Bound { leaf, least, most, get }
}

/// What is believed of a map in the state, and how reflectors are found in a scan.
pub(super) const DETAIL_BOUNDS: [Bound; 29] = [
    bound("vehicle.encoder_offset", -50.0, 50.0, |parameters| match &parameters.vehicle {
        Vehicle::Ackermann(car) => Some(car.encoder_offset),
        _ => None,
    }),
    bound("slam.biases.scale", 0.0, 1.0, |parameters| Some(parameters.slam.biases.scale)),
    bound("slam.biases.steering", 0.0, 1.0, |parameters| Some(parameters.slam.biases.steering)),
    bound("slam.biases.laser_yaw", 0.0, 1.0, |parameters| Some(parameters.slam.biases.laser_yaw)),
    bound("slam.bias_walk.scale", 0.0, 1.0, |parameters| Some(f64::from(parameters.slam.bias_walk.scale))),
    bound("slam.bias_walk.steering", 0.0, 1.0, |parameters| Some(f64::from(parameters.slam.bias_walk.steering))),
    bound("slam.bias_walk.laser_yaw", 0.0, 1.0, |parameters| Some(f64::from(parameters.slam.bias_walk.laser_yaw))),
    bound("slam.orientation_tolerance", 0.0, TURN, |parameters| Some(f64::from(parameters.slam.orientation_tolerance))),
    bound("slam.least_distance", 0.0, 100.0, |parameters| Some(parameters.slam.least_distance)),
    bound("slam.place_size", 0.0, 100.0, |parameters| Some(parameters.slam.place_size)),
    bound("slam.place_turn", 0.0, TURN, |parameters| Some(parameters.slam.place_turn)),
    bound("slam.key_scans.spacing", 0.01, 1000.0, |parameters| Some(parameters.slam.key_scans.spacing)),
    bound("slam.key_scans.turn", 0.01, TURN, |parameters| Some(parameters.slam.key_scans.turn)),
    bound("slam.key_scans.least_share", 0.0, 1.0, |parameters| Some(parameters.slam.key_scans.least_share)),
    bound("slam.key_scans.inflation", 1.0, 1e6, |parameters| Some(parameters.slam.key_scans.inflation)),
    bound("slam.key_scans.position_floor", 0.0, 10.0, |parameters| Some(parameters.slam.key_scans.position_floor)),
    bound("slam.key_scans.heading_floor", 0.0, 1.0, |parameters| Some(parameters.slam.key_scans.heading_floor)),
    bound("slam.key_scans.gate", 0.1, 1000.0, |parameters| Some(parameters.slam.key_scans.gate)),
    bound("slam.key_scans.surfaces.radius", 0.001, 10.0, |parameters| {
        Some(f64::from(parameters.slam.key_scans.surfaces.radius))
    }),
    bound("slam.key_scans.surfaces.growth", 0.0, 10.0, |parameters| {
        Some(f64::from(parameters.slam.key_scans.surfaces.growth))
    }),
    bound("slam.key_scans.surfaces.residual", SMALL, 10.0, |parameters| {
        Some(f64::from(parameters.slam.key_scans.surfaces.residual))
    }),
    bound("slam.key_scans.alignment.reach", 0.001, 10.0, |parameters| {
        Some(f64::from(parameters.slam.key_scans.alignment.reach))
    }),
    bound("slam.key_scans.alignment.tolerance", 0.001, 10.0, |parameters| {
        Some(f64::from(parameters.slam.key_scans.alignment.tolerance))
    }),
    bound("slam.key_scans.alignment.range_deviation", SMALL, 10.0, |parameters| {
        Some(f64::from(parameters.slam.key_scans.alignment.range_deviation))
    }),
    bound("slam.key_scans.alignment.surface_deviation", SMALL, 10.0, |parameters| {
        Some(f64::from(parameters.slam.key_scans.alignment.surface_deviation))
    }),
    bound("reflectors.detection.largest_step", 0.0, 100.0, |parameters| {
        Some(f64::from(parameters.reflectors.detection?.largest_step))
    }),
    bound("reflectors.detection.largest_width", 0.0, 100.0, |parameters| {
        Some(f64::from(parameters.reflectors.detection?.largest_width))
    }),
    bound("reflectors.detection.farthest", 0.1, 1000.0, |parameters| {
        Some(f64::from(parameters.reflectors.detection?.farthest))
    }),
    bound("reflectors.detection.centre_offset", -10.0, 10.0, |parameters| {
        Some(f64::from(parameters.reflectors.detection?.centre_offset))
    }),
];
