//! The model of the joint fit against its own finite differences and against the core's kinematics.

use agv_core::geometry::Pose;
use agv_core::measurement::Time;
use agv_core::odometry::{Control, Integration};
use agv_host_sim::calibrate::model::{PARAMETERS, VehicleModel};
use agv_host_sim::calibrate::window::{Step, Window};
use nalgebra::Matrix3;
use proptest::prelude::*;

fn window(steps: Vec<Step>) -> Window {
    Window {
        start: Time::default(),
        end: Time::default(),
        steps,
        motion: Pose::default(),
        pose_errors: [Matrix3::zeros(); 2],
        shares_start: false,
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn derivatives_are_those_of_the_motion(
        forward in -0.2..0.2_f64, backward in -0.2..0.2_f64, wheelbase in 0.8..3.0_f64, ratio in 0.5..1.5_f64,
        x in -2.0..2.0_f64, y in -1.0..1.0_f64, heading in -3.0..3.0_f64,
        steps in prop::collection::vec((-8000.0..8000.0_f64, -0.9..0.9_f64), 1..6),
    ) {
        let laser = Pose::new(x, y, heading);
        let model = VehicleModel {
            offset_forward: forward, offset_backward: backward, drive_scale: 0.25e-3, wheelbase, steering_ratio: ratio, laser,
        };
        let window = window(steps.iter().map(|&(ticks, steering)| Step { ticks, steering }).collect());
        let (motion, derivative) = model.laser_motion(&window);
        for parameter in 0..PARAMETERS {
            let step = 1e-6 * model.vector()[parameter].abs().max(1e-3);
            let moved = |sign: f64| {
                let mut vector = model.vector();
                vector[parameter] += sign * step;
                VehicleModel::from_vector(&vector).laser_motion(&window).0
            };
            let difference = (moved(1.0) - moved(-1.0)) / (2.0 * step);
            let scale = difference.amax().max(derivative.column(parameter).amax()).max(1.0);
            prop_assert!((difference - derivative.column(parameter)).amax() < 2e-6 * scale, "parameter {parameter}");
        }
        // The same motion by the core's kinematics.
        let mut pose = Pose::default();
        for &(ticks, steering) in &steps {
            let angle = ratio * steering + if ticks < 0.0 { backward } else { forward };
            let control = Control { distance: 0.25e-3 * ticks, steering_start: angle, steering_end: angle };
            pose = pose.compose(&control.displacement(wheelbase, Integration::Arc));
        }
        let seen = laser.between(&pose.compose(&laser));
        prop_assert!((seen.x - motion.x).abs() < 1e-9 && (seen.y - motion.y).abs() < 1e-9);
        prop_assert!(agv_core::geometry::difference(seen.theta, motion.z).abs() < 1e-9);
    }

    #[test]
    fn errors_of_poses_become_the_covariance_of_the_motion(
        x in -5.0..5.0_f64, y in -5.0..5.0_f64, heading in -3.0..3.0_f64, errors in prop::array::uniform6(-1e-4..1e-4_f64),
    ) {
        // A covariance of rank one stands for one error; the motion between the erring poses must differ by its root.
        let (start, end) = (Pose::new(1.0, 2.0, 0.5), Pose::new(1.0, 2.0, 0.5).compose(&Pose::new(x, y, heading)));
        let [a, b, c, d, e, f] = errors;
        let (first, second) = (nalgebra::Vector3::new(a, b, c), nalgebra::Vector3::new(d, e, f));
        let off = |pose: &Pose, error: &nalgebra::Vector3<f64>| pose.compose(&Pose::new(error.x, error.y, error.z));
        let motion = start.between(&end);
        for (errors, moved) in [
            ([first * first.transpose(), Matrix3::zeros()], off(&start, &first).between(&end)),
            ([Matrix3::zeros(), second * second.transpose()], start.between(&off(&end, &second))),
        ] {
            let window = Window { motion, pose_errors: errors, ..window(Vec::new()) };
            let change = nalgebra::Vector3::new(
                moved.x - motion.x, moved.y - motion.y, agv_core::geometry::difference(moved.theta, motion.theta),
            );
            prop_assert!((window.covariance() - change * change.transpose()).amax() < 1e-10);
        }
    }
}
