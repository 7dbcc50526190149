//! Covariances that a motion carries on, against derivatives taken by finite differences, with every covariance full.
#![allow(clippy::indexing_slicing, reason = "a panic is how a test fails")]

use agv_core::filter::Ekf;
use agv_core::geometry::{Pose, difference};
use agv_core::measurement::Time;
use agv_core::odometry::Motion;
use nalgebra::{Matrix3, SMatrix, Vector3};

use super::falko::scene::Random;

/// A covariance with these deviations at most and all correlations.
fn covariance(random: &mut Random, deviations: [f64; 3]) -> Matrix3<f64> {
    let root = Matrix3::from_fn(|row, _| deviations[row] * random.uniform(-1.0, 1.0));
    root * root.transpose()
}

#[test]
fn a_prediction_carries_the_whole_covariance() {
    let mut random = Random::new(13);
    for _ in 0..200 {
        let mut any = |size: f64| random.uniform(-size, size);
        let pose = Pose::new(any(20.0), any(20.0), any(3.1));
        let displacement = Pose::new(any(0.5), any(0.2), any(0.4));
        let prior = covariance(&mut random, [0.3, 0.2, 0.1]);
        let noise = covariance(&mut random, [0.02, 0.01, 0.03]);
        let moved = |by: usize, step: f64| {
            let mut values = [pose.x, pose.y, pose.theta, displacement.x, displacement.y, displacement.theta];
            values[by] += step;
            let [x, y, theta, along, across, turn] = values;
            Pose::new(x, y, theta).compose(&Pose::new(along, across, turn))
        };
        let step = 1e-6;
        let jacobian = SMatrix::<f64, 3, 6>::from_columns(&[0, 1, 2, 3, 4, 5].map(|by| {
            let (above, below) = (moved(by, step), moved(by, -step));
            Vector3::new(above.x - below.x, above.y - below.y, difference(above.theta, below.theta)) / (2.0 * step)
        }));
        let mut joint = SMatrix::<f64, 6, 6>::zeros();
        joint.fixed_view_mut::<3, 3>(0, 0).copy_from(&prior);
        joint.fixed_view_mut::<3, 3>(3, 3).copy_from(&noise);
        let mut state = Ekf::with_covariance(pose, &prior);
        state.predict(&Motion { displacement, covariance: noise, ..Motion::none(Time::default()) });
        let expected = jacobian * joint * jacobian.transpose();
        assert!((state.covariance() - expected).norm() < 1e-7 * expected.norm(), "{} {expected}", state.covariance());
        let off = pose.compose(&displacement).between(&state.pose);
        assert!(off.x.hypot(off.y) < 1e-12 && off.theta.abs() < 1e-12);
    }
}
