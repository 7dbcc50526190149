//! Observations as positions, and their limits, against sampling and finite differences.

use agv_core::filter::{Cartesian, Ekf, Innovation, Observation, RangeBearing};
use agv_core::geometry::{Point, Pose};
use nalgebra::{Matrix2, Vector2};
use proptest::prelude::*;

use super::support::view::linearise;

proptest! {
    #[test]
    fn distance_and_direction_become_a_position_with_its_covariance(
        range in 0.1f64..60.0, bearing in -3.1f64..3.1, range_deviation in 1e-4f64..0.05, bearing_deviation in 1e-5f64..0.01,
    ) {
        let seen = RangeBearing {
            range, bearing, range_variance: range_deviation.powi(2), bearing_variance: bearing_deviation.powi(2),
        };
        let position = |range: f64, bearing: f64| Point::new(range * bearing.cos(), range * bearing.sin());
        let step = 1e-6;
        let by_range = (position(range + step, bearing) - position(range - step, bearing)) / (2.0 * step);
        let by_bearing = (position(range, bearing + step) - position(range, bearing - step)) / (2.0 * step);
        let expected = by_range * by_range.transpose() * seen.range_variance
            + by_bearing * by_bearing.transpose() * seen.bearing_variance;
        let Cartesian { position: at, covariance } = seen.cartesian();
        prop_assert!((at - position(range, bearing)).norm() < 1e-12);
        prop_assert!((covariance - expected).norm() < 1e-6 * expected.norm());
        prop_assert_eq!(Observation::RangeBearing(seen).position(), at);
        prop_assert_eq!(Observation::Cartesian(seen.cartesian()).position(), at);
    }
}

#[test]
fn a_landmark_at_the_sensor_has_no_direction() {
    let seen = Observation::RangeBearing(RangeBearing {
        range: 0.5,
        bearing: 0.0,
        range_variance: 1e-4,
        bearing_variance: 1e-6,
    });
    let laser = Pose::new(0.9, 0.2, 0.4);
    let at =
        |distance: f64| linearise(&seen, &Pose::default(), &laser, &Point::new(0.9 + distance, 0.2), 0.0).is_some();
    assert_eq!([0.0, 0.0009, 0.0011, 0.5, f64::NAN].map(at), [false, false, true, true, false]);
}

#[test]
fn what_has_no_finite_distance_is_no_innovation() {
    let innovation = |covariance: Matrix2<f64>, residual: Vector2<f64>| Innovation::new(residual, covariance);
    let residual = Vector2::new(3.0, -1.0);
    let covariance = Matrix2::new(4.0, 1.0, 1.0, 2.0);
    let told =
        innovation(covariance, residual).unwrap_or(Innovation { residual, covariance, normalised_square: f64::NAN });
    // (3, -1) with the inverse (2, -1; -1, 4) / 7.
    assert!((told.normalised_square - 28.0 / 7.0).abs() < 1e-12, "{told:?}");
    assert_eq!((told.residual, told.covariance), (residual, covariance));
    let broken = [
        Matrix2::zeros(),
        Matrix2::new(1.0, 1.0, 1.0, 1.0),
        Matrix2::new(-1.0, 0.0, 0.0, -1.0),
        Matrix2::new(1.0, 0.0, 0.0, -1.0),
        Matrix2::new(f64::NAN, 0.0, 0.0, 1.0),
        Matrix2::new(f64::INFINITY, 0.0, 0.0, 1.0),
        Matrix2::new(1e-200, 0.0, 0.0, 1e-120),
    ];
    for covariance in broken {
        assert_eq!(innovation(covariance, residual), None, "{covariance}");
    }
    assert_eq!(innovation(covariance, Vector2::new(f64::NAN, 0.0)), None);
}

#[test]
fn a_correction_that_is_not_finite_changes_nothing() {
    let landmark = Point::new(5.0, 1.0);
    let state = Ekf::new(Pose::new(0.1, 0.2, 0.3), 0.05, 0.02);
    let seen = |range: f64, range_variance: f64| {
        Observation::RangeBearing(RangeBearing { range, bearing: 0.1, range_variance, bearing_variance: 1e-6 })
    };
    for (range, variance) in [(f64::NAN, 1e-4), (f64::INFINITY, 1e-4), (5.0, f64::NAN), (5.0, -1e9)] {
        let mut corrected = state;
        let told = linearise(&seen(range, variance), &state.pose, &Pose::default(), &landmark, 0.0);
        assert!(told.is_some_and(|told| !corrected.correct(&told)), "{range} {variance}");
        assert_eq!(corrected, state);
    }
}

#[test]
fn deviations_are_those_of_the_worst_direction() {
    for angle in [0.0, 0.4, 1.2, 2.5_f64] {
        let (sine, cosine) = angle.sin_cos();
        let turn = nalgebra::Matrix3::new(cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0);
        let covariance = turn * nalgebra::Matrix3::from_diagonal(&[0.09, 0.01, 0.04].into()) * turn.transpose();
        let state = Ekf::with_covariance(Pose::default(), &covariance);
        assert!((state.position_deviation() - 0.3).abs() < 1e-12 && (state.heading_deviation() - 0.2).abs() < 1e-12);
    }
    let broken = Ekf::with_covariance(Pose::default(), &-nalgebra::Matrix3::identity());
    assert_eq!((broken.position_deviation(), broken.heading_deviation()), (0.0, 0.0));
}
