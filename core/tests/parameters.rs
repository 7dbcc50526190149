//! Parameters with which nothing can be computed are named.

use agv_core::geometry::Pose;
use agv_core::localizer::{Limits, ParameterError, Parameters, bounds};
use agv_core::measurement::LaserId;
use agv_core::odometry::{Ackermann, CounterRange, Tricycle, Vehicle};

const TRICYCLE: Tricycle = Tricycle {
    wheelbase: 1.5,
    drive_scale: 1e-4,
    drive_range: CounterRange::BITS_32,
    steering_scale: 1e-4,
    steering_range: CounterRange::BITS_16,
    steering_offset_forward: 0.0,
    steering_offset_backward: 0.0,
};

fn parameters() -> Parameters {
    Parameters::new(Vehicle::Tricycle(TRICYCLE), Pose::new(0.9, 0.0, 0.0))
}

#[test]
fn the_default_parameters_of_every_vehicle_are_sound() {
    let vehicles = [
        Vehicle::Tricycle(TRICYCLE),
        Vehicle::Ackermann(Ackermann { wheelbase: 2.8, encoder_offset: 0.7 }),
        Vehicle::Increments,
    ];
    for vehicle in vehicles {
        assert_eq!(Parameters { vehicle, ..parameters() }.check(), Ok(()));
    }
}

#[test]
fn the_wheelbase_of_a_car_and_the_mount_of_a_second_laser_are_bounded_too() {
    let car = Vehicle::Ackermann(Ackermann { wheelbase: f64::NAN, encoder_offset: 0.7 });
    assert_eq!(Parameters { vehicle: car, ..parameters() }.check(), Err(ParameterError { leaf: "vehicle.wheelbase" }));
    let mut two = parameters();
    two.lasers.set(LaserId::new(1).unwrap_or(LaserId::FIRST), Pose { x: 0.0, y: f64::INFINITY, theta: 0.0 });
    assert_eq!(two.check(), Err(ParameterError { leaf: "laser.y" }));
}

type Set = fn(&mut Parameters, f64);

#[test]
fn what_is_no_number_or_beyond_its_bounds_is_named() {
    let cases: [(&'static str, Set); 7] = [
        ("laser.x", |parameters, value| parameters.lasers.first_mut().x = value),
        ("laser.theta", |parameters, value| parameters.lasers.first_mut().theta = value),
        ("odometry.unknown_turn", |parameters, value| parameters.odometry_noise.unknown_turn = value),
        ("reflectors.range_deviation", |parameters, value| parameters.reflectors.range_deviation = value),
        ("association.gate", |parameters, value| parameters.association.gate = value),
        ("consistency.memory", |parameters, value| parameters.consistency.memory = value),
        ("limits.fastest", |parameters, value| parameters.limits.fastest = value),
    ];
    for (leaf, set) in cases {
        let (least, most) = bounds(leaf).unwrap_or((f64::NAN, f64::NAN));
        for (value, expected) in [
            (least, Ok(())),
            (most, Ok(())),
            (least - 1e-6 - least.abs() * 1e-6, Err(ParameterError { leaf })),
            (most + 1e-6 + most.abs() * 1e-6, Err(ParameterError { leaf })),
            (f64::NAN, Err(ParameterError { leaf })),
            (f64::INFINITY, Err(ParameterError { leaf })),
        ] {
            let mut changed = parameters();
            set(&mut changed, value);
            assert_eq!(changed.check(), expected, "{leaf} {value}");
        }
    }
}

#[test]
fn a_wheel_without_a_scale_and_ranges_that_exclude_each_other_are_named() {
    for (leaf, tricycle) in [
        ("vehicle.wheelbase", Tricycle { wheelbase: 0.0, ..TRICYCLE }),
        ("vehicle.drive_scale", Tricycle { drive_scale: 0.0, ..TRICYCLE }),
        ("vehicle.steering_scale", Tricycle { steering_scale: 0.0, ..TRICYCLE }),
    ] {
        let changed = Parameters { vehicle: Vehicle::Tricycle(tricycle), ..parameters() };
        assert_eq!(changed.check(), Err(ParameterError { leaf }));
    }
    let mut changed = parameters();
    changed.features.nearest = changed.features.farthest;
    let error = changed.check().err();
    assert_eq!(error, Some(ParameterError { leaf: "features.nearest" }));
    assert_eq!(error.map(|error| error.to_string()).as_deref(), Some("features.nearest is out of its bounds"));
}

#[test]
fn samples_may_be_two_and_a_half_times_as_far_apart_as_is_extrapolated_and_a_quarter_of_a_second_in_any_case() {
    for (longest_extrapolation, expected) in [(0.0, 0.25), (0.08, 0.25), (0.1, 0.25), (0.2, 0.5), (1.0, 2.5)] {
        let limits = Limits { longest_extrapolation, ..Limits::default() };
        assert!((limits.longest_interval() - expected).abs() < 1e-12, "{longest_extrapolation} s: {limits:?}");
    }
}

#[test]
fn a_gyro_that_is_fitted_has_a_factor() {
    for (is_fitted, factor, error) in [(true, 0.0, Some("gyro.factor")), (true, 1.0, None), (false, 0.0, None)] {
        let mut changed = parameters();
        (changed.gyro.is_fitted, changed.gyro.factor) = (is_fitted, factor);
        assert_eq!(changed.check().err().map(|error| error.leaf), error, "{is_fitted}, {factor}");
    }
}

/// Numbers that no setting changes: each is refused under its own name.
#[test]
fn numbers_of_the_map_in_the_state_and_of_the_detectors_are_bounded_too() {
    use agv_core::odometry::TricycleSpeed;
    use agv_core::sensing::ReflectorDetection;
    type Set = fn(&mut Parameters, f64);
    const LEAVES: [(&str, Set); 16] = [
        ("vehicle.encoder_offset", |parameters, value| {
            parameters.vehicle = Vehicle::Ackermann(Ackermann { wheelbase: 2.8, encoder_offset: value });
        }),
        ("vehicle.steering_offset_forward", |parameters, value| {
            parameters.vehicle = Vehicle::TricycleSpeed(TricycleSpeed { wheelbase: 1.2, steering_offset: value });
        }),
        ("slam.biases.scale", |parameters, value| parameters.slam.biases.scale = value),
        ("slam.biases.laser_yaw", |parameters, value| parameters.slam.biases.laser_yaw = value),
        ("slam.bias_walk.scale", |parameters, value| parameters.slam.bias_walk.scale = value as f32),
        ("slam.orientation_tolerance", |parameters, value| parameters.slam.orientation_tolerance = value as f32),
        ("slam.least_distance", |parameters, value| parameters.slam.least_distance = value),
        ("slam.place_size", |parameters, value| parameters.slam.place_size = value),
        ("slam.key_scans.spacing", |parameters, value| parameters.slam.key_scans.spacing = value),
        ("slam.key_scans.inflation", |parameters, value| parameters.slam.key_scans.inflation = value),
        ("slam.key_scans.gate", |parameters, value| parameters.slam.key_scans.gate = value),
        ("slam.key_scans.surfaces.radius", |parameters, value| {
            parameters.slam.key_scans.surfaces.radius = value as f32;
        }),
        ("slam.key_scans.alignment.reach", |parameters, value| {
            parameters.slam.key_scans.alignment.reach = value as f32;
        }),
        ("reflectors.detection.centre_offset", |parameters, value| {
            let detection = ReflectorDetection { centre_offset: value as f32, ..ReflectorDetection::default() };
            parameters.reflectors.detection = Some(detection);
        }),
        ("features.detector", |parameters, value| parameters.features.detector.radius_scale = value as f32),
        ("features.detector", |parameters, value| parameters.features.detector.jump = Some(value as f32)),
    ];
    for (leaf, set) in LEAVES {
        for value in [f64::NAN, f64::INFINITY, 1e30, -1e30] {
            let mut changed = parameters();
            set(&mut changed, value);
            assert_eq!(changed.check(), Err(ParameterError { leaf }), "{value}");
        }
    }
}
