//! Between what every number of the parameters must lie.

use super::Parameters;
use super::detail_bounds::DETAIL_BOUNDS;
use crate::odometry::{Tricycle, Vehicle};

/// The bounds of one number.
pub(super) struct Bound {
    pub leaf: &'static str,
    pub least: f64,
    pub most: f64,
    pub get: fn(&Parameters) -> Option<f64>,
}

/// A parameter with which nothing can be computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParameterError {
    /// Its name, as the settings have it.
    pub leaf: &'static str,
}

impl core::fmt::Display for ParameterError {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(formatter, "{} is out of its bounds", self.leaf)
    }
}

impl core::error::Error for ParameterError {}

pub(super) const TURN: f64 = core::f64::consts::TAU;
/// The bounds of a standard deviation: zero would be certainty.
pub(super) const SMALL: f64 = 1e-9;

const fn tricycle(parameters: &Parameters) -> Option<&Tricycle> {
    match &parameters.vehicle {
        Vehicle::Tricycle(tricycle) => Some(tricycle),
        _ => None,
    }
}

/// What is added to the steering angle, of the vehicles whose controllers tell one.
const fn steering_offset(parameters: &Parameters) -> Option<f64> {
    match &parameters.vehicle {
        Vehicle::Tricycle(tricycle) => Some(tricycle.steering_offset_forward),
        Vehicle::TricycleSpeed(tricycle) => Some(tricycle.steering_offset),
        _ => None,
    }
}

/// The distance of the axles, of the vehicles that have one.
const fn wheelbase(parameters: &Parameters) -> Option<f64> {
    match &parameters.vehicle {
        Vehicle::Tricycle(tricycle) => Some(tricycle.wheelbase),
        Vehicle::Ackermann(car) => Some(car.wheelbase),
        Vehicle::TricycleSpeed(tricycle) => Some(tricycle.wheelbase),
        Vehicle::Increments | Vehicle::Wheels(_) => None,
    }
}

const BOUNDS: [Bound; 59] = [
    Bound { leaf: "vehicle.wheelbase", least: 0.05, most: 50.0, get: wheelbase },
    Bound {
        leaf: "vehicle.drive_scale",
        least: -1.0,
        most: 1.0,
        get: |parameters| Some(tricycle(parameters)?.drive_scale),
    },
    Bound {
        leaf: "vehicle.steering_scale",
        least: -1.0,
        most: 1.0,
        get: |parameters| Some(tricycle(parameters)?.steering_scale),
    },
    Bound { leaf: "vehicle.steering_offset_forward", least: -TURN, most: TURN, get: steering_offset },
    Bound {
        leaf: "vehicle.steering_offset_backward",
        least: -TURN,
        most: TURN,
        get: |parameters| Some(tricycle(parameters)?.steering_offset_backward),
    },
    Bound { leaf: "laser.x", least: -20.0, most: 20.0, get: |parameters| Some(parameters.lasers.first().x) },
    Bound { leaf: "laser.y", least: -20.0, most: 20.0, get: |parameters| Some(parameters.lasers.first().y) },
    Bound { leaf: "laser.theta", least: -TURN, most: TURN, get: |parameters| Some(parameters.lasers.first().theta) },
    Bound {
        leaf: "odometry.speed_deviation",
        least: 0.0,
        most: 10.0,
        get: |parameters| Some(parameters.odometry_noise.speed),
    },
    Bound {
        leaf: "odometry.steering_deviation",
        least: 0.0,
        most: 1.0,
        get: |parameters| Some(parameters.odometry_noise.steering),
    },
    Bound { leaf: "odometry.slip", least: 0.0, most: 1.0, get: |parameters| Some(parameters.odometry_noise.slip) },
    Bound {
        leaf: "odometry.side_slip",
        least: 0.0,
        most: 1.0,
        get: |parameters| Some(parameters.odometry_noise.side_slip),
    },
    Bound { leaf: "odometry.yaw", least: 0.0, most: 1.0, get: |parameters| Some(parameters.odometry_noise.yaw) },
    Bound { leaf: "odometry.turn", least: 0.0, most: 1.0, get: |parameters| Some(parameters.odometry_noise.turn) },
    Bound {
        leaf: "odometry.unknown_acceleration",
        least: SMALL,
        most: 100.0,
        get: |parameters| Some(parameters.odometry_noise.unknown_acceleration),
    },
    Bound {
        leaf: "odometry.unknown_turn",
        least: SMALL,
        most: 100.0,
        get: |parameters| Some(parameters.odometry_noise.unknown_turn),
    },
    Bound { leaf: "gyro.factor", least: -10.0, most: 10.0, get: |parameters| Some(parameters.gyro.factor) },
    Bound { leaf: "gyro.latency", least: 0.0, most: 0.2, get: |parameters| Some(parameters.gyro.latency) },
    Bound { leaf: "gyro.noise", least: SMALL, most: 0.1, get: |parameters| Some(parameters.gyro.noise) },
    Bound { leaf: "gyro.bias", least: SMALL, most: 1.0, get: |parameters| Some(parameters.gyro.bias) },
    Bound { leaf: "gyro.drift", least: 0.0, most: 0.1, get: |parameters| Some(parameters.gyro.drift) },
    Bound { leaf: "gyro.scale", least: SMALL, most: 0.5, get: |parameters| Some(parameters.gyro.scale) },
    Bound { leaf: "gyro.range", least: 0.01, most: 1000.0, get: |parameters| Some(parameters.gyro.range) },
    Bound {
        leaf: "reflectors.range_deviation",
        least: SMALL,
        most: 10.0,
        get: |parameters| Some(parameters.reflectors.range_deviation),
    },
    Bound {
        leaf: "reflectors.bearing_deviation",
        least: SMALL,
        most: 1.0,
        get: |parameters| Some(parameters.reflectors.bearing_deviation),
    },
    Bound {
        leaf: "features.nearest",
        least: 0.0,
        most: 250.0,
        get: |parameters| Some(f64::from(parameters.features.nearest)),
    },
    Bound {
        leaf: "features.farthest",
        least: 0.1,
        most: 250.0,
        get: |parameters| Some(f64::from(parameters.features.farthest)),
    },
    Bound {
        leaf: "features.added_deviation",
        least: 0.0,
        most: 10.0,
        get: |parameters| Some(parameters.features.added_deviation),
    },
    Bound {
        leaf: "association.reflector_radius",
        least: 0.01,
        most: 50.0,
        get: |parameters| Some(parameters.association.reflector_radius),
    },
    Bound {
        leaf: "association.feature_radius",
        least: 0.01,
        most: 50.0,
        get: |parameters| Some(parameters.association.feature_radius),
    },
    Bound { leaf: "association.gate", least: 0.1, most: 1000.0, get: |parameters| Some(parameters.association.gate) },
    Bound {
        leaf: "association.margin",
        least: 0.0,
        most: 1000.0,
        get: |parameters| Some(parameters.association.margin),
    },
    Bound {
        leaf: "association.shared_map_error",
        least: 1.0,
        most: 10_000.0,
        get: |parameters| Some(parameters.association.shared_map_error),
    },
    Bound {
        leaf: "dynamic_map.update_rate",
        least: 0.0,
        most: 1.0,
        get: |parameters| Some(parameters.dynamic_map.update_rate),
    },
    Bound {
        leaf: "dynamic_map.deviation",
        least: 0.0,
        most: 10.0,
        get: |parameters| Some(parameters.dynamic_map.deviation),
    },
    Bound {
        leaf: "consistency.memory",
        least: 1.0,
        most: 10_000.0,
        get: |parameters| Some(parameters.consistency.memory),
    },
    Bound {
        leaf: "consistency.least_remaining",
        least: 0.0,
        most: 1.0,
        get: |parameters| Some(parameters.consistency.least_remaining),
    },
    Bound {
        leaf: "consistency.least_observations",
        least: 0.0,
        most: 10_000.0,
        get: |parameters| Some(parameters.consistency.least_observations),
    },
    Bound {
        leaf: "consistency.least_acceptance",
        least: 0.0,
        most: 1.0,
        get: |parameters| Some(parameters.consistency.least_acceptance),
    },
    Bound {
        leaf: "consistency.largest_normalised_square",
        least: 2.0,
        most: 1000.0,
        get: |parameters| Some(parameters.consistency.largest_normalised_square),
    },
    Bound { leaf: "limits.fastest", least: 0.1, most: 100.0, get: |parameters| Some(parameters.limits.fastest) },
    Bound {
        leaf: "limits.dead_reckoning_from",
        least: 0.0,
        most: 10_000.0,
        get: |parameters| Some(parameters.limits.dead_reckoning_from),
    },
    Bound {
        leaf: "limits.lost_after",
        least: 0.1,
        most: 100_000.0,
        get: |parameters| Some(parameters.limits.lost_after),
    },
    Bound {
        leaf: "limits.largest_position_deviation",
        least: SMALL,
        most: 1000.0,
        get: |parameters| Some(parameters.limits.largest_position_deviation),
    },
    Bound {
        leaf: "limits.largest_heading_deviation",
        least: SMALL,
        most: TURN,
        get: |parameters| Some(parameters.limits.largest_heading_deviation),
    },
    Bound {
        leaf: "limits.longest_extrapolation",
        least: 0.0,
        most: 10.0,
        get: |parameters| Some(parameters.limits.longest_extrapolation),
    },
    Bound {
        leaf: "alert_limits.travel.position",
        least: 0.001,
        most: 1.0,
        get: |parameters| Some(parameters.alert_limits.travel.position),
    },
    Bound {
        leaf: "alert_limits.travel.heading",
        least: 0.0001,
        most: 0.25,
        get: |parameters| Some(parameters.alert_limits.travel.heading),
    },
    Bound {
        leaf: "alert_limits.docking.position",
        least: 0.001,
        most: 1.0,
        get: |parameters| Some(parameters.alert_limits.docking.position),
    },
    Bound {
        leaf: "alert_limits.docking.heading",
        least: 0.0001,
        most: 0.25,
        get: |parameters| Some(parameters.alert_limits.docking.heading),
    },
    Bound { leaf: "assumed.mounting", least: SMALL, most: 0.1, get: |parameters| Some(parameters.assumed.mounting) },
    Bound {
        leaf: "assumed.mounting_yaw",
        least: SMALL,
        most: 0.1,
        get: |parameters| Some(parameters.assumed.mounting_yaw),
    },
    Bound { leaf: "assumed.clock", least: SMALL, most: 0.1, get: |parameters| Some(parameters.assumed.clock) },
    Bound { leaf: "assumed.scale", least: SMALL, most: 0.1, get: |parameters| Some(parameters.assumed.scale) },
    Bound { leaf: "assumed.steering", least: SMALL, most: 0.1, get: |parameters| Some(parameters.assumed.steering) },
    Bound { leaf: "assumed.turn", least: SMALL, most: 0.1, get: |parameters| Some(parameters.assumed.turn) },
    Bound {
        leaf: "dynamic_map.first_hits",
        least: 0.0,
        most: 65_535.0,
        get: |parameters| Some(f64::from(parameters.dynamic_map.first_hits)),
    },
    Bound {
        leaf: "dynamic_map.most_hits",
        least: 1.0,
        most: 65_535.0,
        get: |parameters| Some(f64::from(parameters.dynamic_map.most_hits)),
    },
    Bound {
        leaf: "dynamic_map.least_hits",
        least: 0.0,
        most: 65_535.0,
        get: |parameters| Some(f64::from(parameters.dynamic_map.least_hits)),
    },
];

/// The least and the largest value of a number, by the name that the settings have for it. None if no number has that name.
#[must_use]
pub const fn bounds(leaf: &str) -> Option<(f64, f64)> {
    let mut left: &[Bound] = &BOUNDS;
    while let Some((bound, others)) = left.split_first() {
        if is_same(bound.leaf.as_bytes(), leaf.as_bytes()) {
            return Some((bound.least, bound.most));
        }
        left = others;
    }
    None
}

const fn is_same(mut one: &[u8], mut other: &[u8]) -> bool {
    if one.len() != other.len() {
        return false;
    }
    while let (Some((first, rest)), Some((second, others))) = (one.split_first(), other.split_first()) {
        if *first != *second {
            return false;
        }
        (one, other) = (rest, others);
    }
    true
}

impl Parameters {
    /// Whether the localiser can compute with these parameters.
    ///
    /// # Errors
    /// The first parameter that is not finite, or not within its bounds.
    pub fn check(&self) -> Result<(), ParameterError> {
        for bound in BOUNDS.iter().chain(&DETAIL_BOUNDS) {
            let is_within = (bound.get)(self).is_none_or(|value| (bound.least..=bound.most).contains(&value));
            if !is_within {
                return Err(ParameterError { leaf: bound.leaf });
            }
        }
        for (_, mount) in self.lasers.iter() {
            let numbers = [("laser.x", mount.x), ("laser.y", mount.y), ("laser.theta", mount.theta)];
            let is_within =
                |leaf: &str, value: f64| bounds(leaf).is_none_or(|(least, most)| (least..=most).contains(&value));
            if let Some((leaf, _)) = numbers.into_iter().find(|(leaf, value)| !is_within(leaf, *value)) {
                return Err(ParameterError { leaf });
            }
        }
        let scales = tricycle(self).map(|tricycle| {
            [("vehicle.drive_scale", tricycle.drive_scale), ("vehicle.steering_scale", tricycle.steering_scale)]
        });
        if let Some((leaf, _)) = scales.into_iter().flatten().find(|(_, scale)| *scale == 0.0) {
            return Err(ParameterError { leaf });
        }
        if self.gyro.is_fitted && self.gyro.factor == 0.0 {
            return Err(ParameterError { leaf: "gyro.factor" });
        }
        if matches!(&self.vehicle, Vehicle::Wheels(vehicle) if !vehicle.is_sound()) {
            return Err(ParameterError { leaf: "vehicle" });
        }
        if !self.features.detector.is_sound() {
            return Err(ParameterError { leaf: "features.detector" });
        }
        if self.features.nearest >= self.features.farthest {
            return Err(ParameterError { leaf: "features.nearest" });
        }
        Ok(())
    }
}
