//! Good drives.

use agv_core::maps::{Landmark, LandmarkKind};
use agv_core::odometry::Tricycle;
use agv_host_sim::calibrate::drive::{Drive, MotionSource, Preparation};
use agv_host_sim::calibrate::found::{Grade, Question, find};
use agv_host_sim::calibrate::model::VehicleModel;
use agv_host_sim::calibrate::plan::{Means, PlanError, plan};
use agv_lab::evaluate::calibration::course::{Course, Disturbance, ReflectorMove, TrueVehicle};
use agv_lab::evaluate::calibration::simulated::{self, ADOPTED_ROW, Experiment};
use agv_lab::evaluate::halting_points::{self, Calibrated};

use super::truth::{ATC, JOINT, STC, assert_honest, calibrate, course, segments, vehicle};

#[test]
fn without_noise_only_the_resolution_of_the_encoders_is_left() {
    let log = course(4).log(&Disturbance::NONE, 1);
    for question in [ATC, JOINT, Question { is_wheelbase_free: true, ..JOINT }] {
        let found = calibrate(&log, &question).unwrap();
        let truth = VehicleModel::nominal(&vehicle().tricycle, &vehicle().laser);
        let model = &found.model;
        // Counts of a quarter of a millimetre, and angles of 0.0055 degrees.
        assert!((model.offset_forward - truth.offset_forward).abs() < 3e-5);
        assert!((model.offset_backward - truth.offset_backward).abs() < 3e-5);
        assert!((model.drive_scale / truth.drive_scale - 1.0).abs() < 3e-5);
        assert!((model.wheelbase - truth.wheelbase).abs() < 1e-4);
        assert!((model.laser.position() - truth.laser.position()).norm() < 2e-4);
        assert!((model.laser.theta - truth.laser.theta).abs() < 3e-5);
    }
}

#[test]
fn finer_encoders_leave_less() {
    let coarse = vehicle();
    let fine = Tricycle {
        drive_scale: 1e-6,
        drive_range: agv_core::odometry::CounterRange::BITS_32,
        steering_scale: std::f64::consts::TAU / (1_u64 << 32) as f64,
        steering_range: agv_core::odometry::CounterRange::BITS_32,
        ..coarse.tricycle
    };
    let vehicle = TrueVehicle { tricycle: fine, ..coarse };
    let mut log = Course::new(vehicle, &segments(4), 1.0, 1).log(&Disturbance::NONE, 1);
    let agv_core::odometry::Vehicle::Tricycle(believed) = &mut log.parameters.vehicle else { panic!() };
    believed.drive_scale = 1.001e-6;
    let found = calibrate(&log, &JOINT).unwrap();
    assert!((found.model.drive_scale / 1e-6 - 1.0).abs() < 3e-6, "{:?}", found.model);
    assert!((found.model.offset_forward - fine.steering_offset_forward).abs() < 2e-6, "{:?}", found.model);
    assert!((found.model.laser.position() - vehicle.laser.position()).norm() < 2e-5, "{:?}", found.model);
}

#[test]
fn a_good_drive_is_called_good_and_is_honest() {
    for (disturbance, seed) in [(&Disturbance::MILD, 3), (&Disturbance::MID, 4), (&Disturbance::HARD, 5)] {
        let found = calibrate(&course(6).log(disturbance, seed), &JOINT).unwrap();
        assert_eq!(found.grade(), Grade::Good);
        assert_honest(&found, &vehicle());
        assert_eq!(found.outliers().count(), 0);
        let [wheelbase, deviation] = found.suggested_wheelbase;
        assert!((wheelbase - 1.5).abs() < 5.0 * deviation && deviation < 2e-3, "{wheelbase} +- {deviation}");
    }
}

#[test]
fn one_offset_of_a_vehicle_with_two_lies_between_them() {
    let found = calibrate(&course(4).log(&Disturbance::MILD, 1), &STC).unwrap();
    let (offset, tricycle) = (found.model.offset_forward, vehicle().tricycle);
    assert!(offset < tricycle.steering_offset_forward && offset > tricycle.steering_offset_backward, "{offset}");
}

#[test]
fn the_adopted_design_is_as_precise_as_it_must_be() {
    let experiment = Experiment { runs: 24, seed: 1, row: Some(ADOPTED_ROW) };
    let outcomes = simulated::run(&experiment, || ()).unwrap();
    // cdeg, cdeg, mm a tick, mm, mm, cdeg.
    let limits = [("mild", [0.11, 0.16, 0.9e-5, 0.09, 0.14, 0.20]), ("mid", [0.25, 0.34, 1.2e-5, 0.14, 0.18, 0.30])];
    let list = |figures: &simulated::Figures| {
        let simulated::Figures { alpha_forward_cdeg, alpha_backward_cdeg, drive_scale_mm, .. } = *figures;
        let simulated::Figures { laser_x_mm, laser_y_mm, laser_theta_cdeg, .. } = *figures;
        [alpha_forward_cdeg, alpha_backward_cdeg, drive_scale_mm, laser_x_mm, laser_y_mm, laser_theta_cdeg]
    };
    for outcome in &outcomes {
        assert_eq!((outcome.runs, outcome.refused), (24, 0));
        for (stated, std) in list(&outcome.stated).into_iter().zip(list(&outcome.std)) {
            let quotient = stated / std;
            assert!((0.55..1.8).contains(&quotient), "{} {}: {quotient}", outcome.noise, outcome.method);
        }
    }
    for (noise, limit) in limits {
        for (method, offset_limit) in [("joint_stc", limit[0]), ("joint", limit[1])] {
            let found = outcomes.iter().find(|outcome| (outcome.noise, outcome.method) == (noise, method)).unwrap();
            let limits = [offset_limit, offset_limit, limit[2], limit[3], limit[4], limit[5]];
            let (std, bias) = (list(&found.std), list(&found.bias));
            for index in 0..6 {
                // Of so few runs a deviation is known to 15 per cent, and a mean to a fifth of the deviation.
                assert!(std[index] < 1.35 * limits[index], "{noise} {method} {index}: {}", std[index]);
                assert!(bias[index].abs() < 0.75 * std[index], "{noise} {method} {index}: bias {}", bias[index]);
            }
        }
    }
}

#[test]
fn what_a_plan_promises_is_what_comes_out() {
    let vehicle = vehicle();
    let means = Means {
        vehicle: VehicleModel::nominal(&vehicle.tricycle, &vehicle.laser),
        area: [14.0, 11.0],
        clearance: 1.0,
        steering: [0.35, 0.8],
        time: 450.0,
        speed: 1.0,
    };
    let planned = plan(&means).unwrap();
    assert!(planned.duration <= means.time);
    let size = planned.bounds[1] - planned.bounds[0];
    assert!(size.x.min(size.y) <= 9.0 && size.x.max(size.y) <= 12.0, "{size}");
    let course = Course::new(vehicle, &planned.segments, means.speed, 9);
    assert!((course.duration() - planned.duration).abs() < 0.03 * planned.duration);
    let truth = means.vehicle.vector();
    let mut squares = [0.0; 8];
    const RUNS: u64 = 30;
    for seed in 0..RUNS {
        let found = calibrate(&course.log(&Disturbance::MID, seed), &JOINT).unwrap().model.vector();
        for index in 0..8 {
            squares[index] += (found[index] - truth[index]).powi(2) / RUNS as f64;
        }
    }
    for index in [0, 1, 2, 5, 6, 7] {
        let quotient = squares[index].sqrt() / planned.deviations[index];
        assert!((0.6..1.7).contains(&quotient), "parameter {index}: {quotient}");
    }
}

#[test]
fn a_plan_knows_what_is_impossible() {
    let vehicle = vehicle();
    let means = Means {
        vehicle: VehicleModel::nominal(&vehicle.tricycle, &vehicle.laser),
        area: [14.0, 11.0],
        clearance: 1.0,
        steering: [0.35, 0.8],
        time: 450.0,
        speed: 1.0,
    };
    assert_eq!(plan(&Means { area: [4.0, 3.0], ..means }), Err(PlanError::TooSmall));
    assert_eq!(plan(&Means { time: 60.0, ..means }), Err(PlanError::TooShort));
    let (short, long) =
        (plan(&Means { time: 300.0, ..means }).unwrap(), plan(&Means { time: 900.0, ..means }).unwrap());
    assert!(long.deviations[2] < short.deviations[2] && long.segments.len() > short.segments.len());
}

#[test]
fn a_known_map_places_the_stops() {
    let course = course(4);
    let map: Vec<Landmark> = course
        .reflectors()
        .iter()
        .zip(0..)
        .map(|(place, id)| Landmark { id, kind: LandmarkKind::Reflector, x: place.x, y: place.y, deviation: 0.0 })
        .collect();
    let log = course.log(&Disturbance::MID, 2);
    let drive = Drive::new(&log, &Preparation { map: Some(&map), mend: false }).unwrap();
    assert_eq!(drive.source, MotionSource::ReflectorMap);
    assert_eq!(drive.windows.len(), 16);
    assert_honest(&find(&drive, &JOINT).unwrap(), &vehicle());
    // A map of another hall is not used.
    let other: Vec<Landmark> =
        map.iter().map(|landmark| Landmark { x: 1.7 * landmark.x + 3.0, y: -2.1 * landmark.y, ..*landmark }).collect();
    let drive = Drive::new(&log, &Preparation { map: Some(&other), mend: false }).unwrap();
    assert_eq!(drive.source, MotionSource::ReflectorsAtStops);
    assert!(drive.remarks.iter().any(|remark| remark.contains("map")), "{:?}", drive.remarks);
}

#[test]
fn a_few_moved_reflectors_are_left_out() {
    let moves = [3, 8].map(|reflector| ReflectorMove {
        reflector,
        time: 120.0,
        shift: agv_core::geometry::Point::new(0.12, -0.07),
    });
    let course = Course::with_moved_reflectors(vehicle(), &segments(4), 1.0, 1, &moves);
    let drive = Drive::new(&course.log(&Disturbance::MILD, 1), &Preparation::default()).unwrap();
    assert!(drive.remarks.iter().any(|remark| remark.starts_with("2 reflectors were moved")), "{:?}", drive.remarks);
    assert_honest(&find(&drive, &JOINT).unwrap(), &vehicle());
}

#[test]
fn vehicles_that_differ_stop_at_the_same_points() {
    let outcomes = halting_points::run(1, 5, || ()).unwrap();
    let mean = |wanted| outcomes.iter().find(|outcome| outcome.calibration == wanted).unwrap().mean_distance_mm;
    assert!(mean(Calibrated::Atc) < 5.0 && mean(Calibrated::Joint) < 5.0, "{outcomes:?}");
    assert!(mean(Calibrated::Manual) > 2.0 * mean(Calibrated::Atc), "{outcomes:?}");
    assert!(outcomes.iter().all(|outcome| outcome.missed == 0));
}
