use agv_core::geometry::{Point, Pose, Twist, difference};
use agv_core::measurement::EncoderSample;
use agv_core::odometry::{Tricycle, Vehicle};
use agv_host_sim::recording::RecordedEvent;
use agv_host_sim::simulate::block_storage::BlockStoragePath;
use agv_host_sim::simulate::scenario::{OdometryOptions, Scenario};
use agv_host_sim::simulate::simulate;
use agv_host_sim::simulate::speed_profile::SpeedProfile;
use proptest::prelude::*;

use super::support::{assert_unit_mean_square, distance_to_segment, encoder_samples, first_and_last, hall_scenario};

const PATHS: [BlockStoragePath; 5] =
    [BlockStoragePath::P1, BlockStoragePath::P2, BlockStoragePath::P3, BlockStoragePath::P4, BlockStoragePath::Mapping];

/// The tricycle's equations of motion (K 2.2 and 2.3), integrated over samples.
fn integrate(samples: &[EncoderSample], tricycle: &Tricycle, start: Pose) -> Pose {
    samples.windows(2).fold(start, |pose, pair| {
        let way = tricycle.drive_range.step(pair[0].drive, pair[1].drive) as f64 * tricycle.drive_scale;
        let ticks = tricycle.steering_range.signed(pair[0].steering) + tricycle.steering_range.signed(pair[1].steering);
        let offset = if way >= 0.0 { tricycle.steering_offset_forward } else { tricycle.steering_offset_backward };
        let (sine, cosine) = (0.5 * ticks as f64 * tricycle.steering_scale + offset).sin_cos();
        pose.compose(&Pose::exp(&Twist { x: way * cosine, y: 0.0, theta: way * sine / tricycle.wheelbase }))
    })
}

#[test]
fn perfect_encoders_integrate_to_the_true_pose() {
    for path in PATHS {
        let mut scenario = Scenario::block_storage(path, 11);
        scenario.laser.scans = false;
        scenario.odometry = OdometryOptions::perfect();
        scenario.vehicle.believed.steering_offset_forward_deg = -0.75;
        scenario.vehicle.believed.steering_offset_backward_deg = -0.8;
        // Fine enough that rounding does not count.
        scenario.vehicle.believed.steering_counter = 1 << 24;
        scenario.vehicle.believed.drive_scale = 1e-6;
        scenario.vehicle.believed.drive_counter = 1 << 22;
        let simulation = simulate(&scenario).unwrap();
        let (start, end) = first_and_last(&simulation.recording.truth);
        let samples = encoder_samples(&simulation.recording);
        let off = end.between(&integrate(&samples, &simulation.true_tricycle, start));
        assert!(off.position().norm() < 2e-4, "{path:?} {off:?}");
        assert!(off.theta.abs() < 1e-4, "{path:?} {off:?}");
        let Vehicle::Tricycle(believed) = simulation.recording.parameters.vehicle else { panic!("not a tricycle") };
        let off = end.between(&integrate(&samples, &believed, start));
        assert!(off.position().norm() > 1e-3, "the believed vehicle is as good as the true one: {path:?} {off:?}");
    }
}

#[test]
fn odometry_errors_have_the_stated_statistics() {
    let way = 12.0_f64;
    let yaw_walk = 0.02_f64.to_radians();
    // A heading that walks with q for the root of a metre shifts the end by q sqrt(s^3 / 3).
    let lateral = (yaw_walk * yaw_walk * way.powi(3) / 3.0 + 0.5e-3_f64.powi(2) * way).sqrt();
    let mut errors = [const { Vec::new() }; 3];
    for seed in 0..300 {
        let mut scenario = Scenario::block_storage(BlockStoragePath::P1, seed);
        scenario.laser.scans = false;
        scenario.vehicle.truth.drive_scale_error = 0.0;
        scenario.vehicle.truth.steering_offset_error_deg = 0.0;
        let simulation = simulate(&scenario).unwrap();
        let (start, end) = first_and_last(&simulation.recording.truth);
        let estimate = integrate(&encoder_samples(&simulation.recording), &simulation.true_tricycle, start);
        errors[0].push((estimate.x - end.x) / (3e-3 * way.sqrt()));
        errors[1].push((estimate.y - end.y) / lateral);
        errors[2].push(difference(estimate.theta, end.theta) / (yaw_walk * way.sqrt()));
    }
    for (values, what) in errors.iter().zip(["along", "across", "heading"]) {
        assert_unit_mean_square(values, what);
    }
}

#[test]
fn the_true_vehicle_differs_by_the_stated_amounts_with_all_signs() {
    let mut signs = std::collections::BTreeSet::new();
    for seed in 0..40 {
        let mut scenario = Scenario::block_storage(BlockStoragePath::P4, seed);
        scenario.laser.scans = false;
        let truth = simulate(&scenario).unwrap().true_tricycle;
        let scale = truth.drive_scale / scenario.vehicle.believed.drive_scale - 1.0;
        let offset = truth.steering_offset_forward.to_degrees();
        assert!((scale.abs() - 0.002).abs() < 1e-12 && (offset.abs() - 0.05).abs() < 1e-12);
        signs.insert((scale > 0.0, offset > 0.0));
    }
    assert_eq!(signs.len(), 4);
}

#[test]
fn the_start_pose_has_the_stated_deviations() {
    let mut errors = [const { Vec::new() }; 3];
    for seed in 0..300 {
        let mut scenario = hall_scenario();
        scenario.seed = seed;
        scenario.laser.scans = false;
        let recording = simulate(&scenario).unwrap().recording;
        let Some(RecordedEvent::SetPose(fix)) = recording.events.first() else { panic!("no start pose") };
        let truth = recording.truth[0].pose;
        assert_eq!(fix.time, recording.truth[0].time);
        assert_eq!(fix.position_deviation, 0.005);
        assert!((fix.heading_deviation - 0.03_f64.to_radians()).abs() < 1e-15);
        errors[0].push((fix.pose.x - truth.x) / fix.position_deviation);
        errors[1].push((fix.pose.y - truth.y) / fix.position_deviation);
        errors[2].push(difference(fix.pose.theta, truth.theta) / fix.heading_deviation);
    }
    for (values, what) in errors.iter().zip(["x", "y", "heading"]) {
        assert_unit_mean_square(values, what);
    }
}

#[test]
fn paths_have_their_lengths_and_the_vehicle_keeps_to_them() {
    for (path, length) in PATHS.into_iter().zip([12.0, 12.0, 12.0, 7.0, 34.2]) {
        let shape = path.path();
        assert!((shape.length() - length).abs() < 0.05, "{path:?} {}", shape.length());
        for seed in 0..5 {
            let mut scenario = Scenario::block_storage(path, seed);
            scenario.laser.scans = false;
            let simulation = simulate(&scenario).unwrap();
            let off = shape.end().between(&first_and_last(&simulation.recording.truth).1);
            assert!(off.position().norm() < 0.02 && off.theta.abs() < 0.01, "{path:?} {off:?}");
            for sample in simulation.recording.truth.iter().step_by(20) {
                for ahead in [-0.3, 0.0, 0.9, 1.5] {
                    let point = sample.pose.transform(&Point::new(ahead, 0.0));
                    let distances =
                        simulation.world.segments.iter().map(|segment| distance_to_segment(&point, segment));
                    let clearance = distances.fold(f64::INFINITY, f64::min);
                    assert!(clearance > 0.5, "{path:?} {sample:?} {ahead} {clearance}");
                }
            }
        }
    }
}

proptest! {
    #[test]
    fn speed_profiles_keep_their_limits(
        length in 0.05..50.0, speed in 0.1..2.0, acceleration in 0.1..1.0, braking in 0.1..1.0,
    ) {
        let profile = SpeedProfile::new(length, speed, acceleration, braking);
        prop_assert_eq!(profile.way(0.0), 0.0);
        prop_assert!((profile.way(profile.duration()) - length).abs() < 1e-9);
        let step = profile.duration() / 500.0;
        let ways: Vec<f64> = (0..=500).map(|index| profile.way(f64::from(index) * step)).collect();
        let speeds: Vec<f64> = ways.windows(2).map(|pair| (pair[1] - pair[0]) / step).collect();
        for pair in speeds.windows(2) {
            prop_assert!(pair[0] >= -1e-9 && pair[0] <= speed + 1e-9);
            let change = (pair[1] - pair[0]) / step;
            prop_assert!(change <= acceleration + 1e-6 && change >= -braking - 1e-6);
        }
    }
}

#[test]
fn other_vehicles_report_what_integrates_to_the_true_pose() {
    for reports in ["speed", "increments"] {
        let text = format!("[vehicle]\nreports = \"{reports}\"\n[vehicle.believed]\nencoder_offset = 0.5");
        let hall = hall_scenario();
        let mut scenario = Scenario { world: hall.world, path: hall.path, ..Scenario::parse(&text).unwrap() };
        scenario.laser.scans = false;
        scenario.odometry = OdometryOptions::perfect();
        scenario.vehicle.truth.drive_scale_error = 0.0;
        scenario.vehicle.truth.steering_offset_error_deg = 0.0;
        let recording = simulate(&scenario).unwrap().recording;
        let (start, end) = first_and_last(&recording.truth);
        let mut pose = start;
        let mut previous_steering = None;
        for event in &recording.events {
            match event {
                RecordedEvent::Increment(increment) => pose = pose.compose(&increment.displacement),
                RecordedEvent::Speed(sample) => {
                    let before = previous_steering.replace(sample.steering).unwrap_or(sample.steering);
                    let curvature = (0.5 * (before + sample.steering)).tan() / 1.5;
                    let way = sample.speed * 0.01 / (1.0 - 0.5 * curvature);
                    pose = pose.compose(&Pose::exp(&Twist { x: way, y: 0.0, theta: way * curvature }));
                }
                _ => {}
            }
        }
        let off = end.between(&pose);
        assert!(off.position().norm() < 1e-6 && off.theta.abs() < 1e-6, "{reports} {off:?}");
    }
}
