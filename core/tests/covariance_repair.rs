//! Covariances that rounding has broken, against their correlations and eigenvalues.

use agv_core::filter::Ekf;
use agv_core::geometry::Pose;
use nalgebra::Matrix3;

use super::falko::scene::Random;

fn said(covariance: Matrix3<f64>) -> Matrix3<f64> {
    let [xx, xy, yy, xh, yh, hh] = Ekf::with_covariance(Pose::default(), &covariance).covariance_entries();
    Matrix3::new(xx, xy, xh, xy, yy, yh, xh, yh, hh)
}

/// Unit diagonal, and these correlations.
fn correlated([xy, xh, yh]: [f64; 3]) -> Matrix3<f64> {
    Matrix3::new(1.0, xy, xh, xy, 1.0, yh, xh, yh, 1.0)
}

#[test]
fn a_broken_covariance_is_mended_by_its_correlations() {
    let mut random = Random::new(5);
    let (mut sound, mut cut, mut halved) = (0, 0, 0);
    for _ in 0..20_000 {
        let deviations = [0; 3].map(|_| 10_f64.powf(random.uniform(-4.0, 1.0)));
        let is_negative = [0; 3].map(|_| random.unit() < 0.1);
        let correlations = [0; 3].map(|_| random.uniform(-1.3, 1.3));
        let correlated_so = correlated(correlations);
        let mut covariance =
            Matrix3::from_fn(|row, column| correlated_so[(row, column)] * (deviations[row] * deviations[column]));
        for (axis, is_negative) in is_negative.into_iter().enumerate() {
            if is_negative {
                covariance[(axis, axis)] *= -1.0;
            }
        }
        let [x, y, h] = is_negative;
        let unknown = [x || y, x || h, y || h];
        let is_broken = unknown.contains(&true);
        let mut expected = correlations;
        for (correlation, is_unknown) in expected.iter_mut().zip(unknown) {
            *correlation = if is_unknown { 0.0 } else { correlation.clamp(-1.0, 1.0) };
        }
        let least = correlated(expected).symmetric_eigenvalues().min();
        if least.abs() < 1e-4 {
            continue;
        }
        if least < 0.0 {
            expected = expected.map(|correlation| 0.5 * correlation);
        }
        let mended = said(covariance);
        if !is_broken && least > 0.0 && expected == correlations {
            sound += 1;
            assert_eq!(mended, covariance);
            continue;
        }
        cut += usize::from(least > 0.0);
        halved += usize::from(least < 0.0);
        let whitened = Matrix3::from_fn(|row, column| mended[(row, column)] / (deviations[row] * deviations[column]));
        assert!((whitened - correlated(expected)).norm() < 1e-9, "{correlations:?} {is_negative:?} {whitened}");
    }
    assert!(sound > 1000 && cut > 500 && halved > 1000, "{sound} {cut} {halved}");
}

#[test]
fn what_is_known_exactly_is_sound() {
    for covariance in [Matrix3::zeros(), Matrix3::from_diagonal(&[0.0, 1.0, 0.0].into()), correlated([1.0; 3])] {
        assert_eq!(said(covariance), covariance);
    }
}
