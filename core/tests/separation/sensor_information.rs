//! What landmarks tell of the pose of a sensor.

use agv_core::geometry::{Point, Pose};
use agv_core::integrity::separation::{Seen, SensorInformation};
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector2, Vector3};

use crate::falko::scene::Random;

pub fn landmark(random: &mut Random, sensor: &Pose, noise: f64) -> Seen {
    let landmark = Point::new(random.uniform(-15.0, 15.0), random.uniform(-15.0, 15.0));
    let seen = sensor.inverse_transform(&landmark);
    let position = Point::new(seen.x + noise * random.normal(), seen.y + noise * random.normal());
    let (a, b, c) = (random.uniform(0.5, 2.0), random.uniform(-0.4, 0.4), random.uniform(0.5, 2.0));
    let covariance = Matrix2::new(a, b, b, c) * 1e-4;
    Seen { position, covariance, landmark, landmark_variance: 4e-6 }
}

/// Where the landmark seems to be minus where it is, if the sensor is so far beside the pose.
fn miss(seen: &Seen, sensor: &Pose, beside: &[f64]) -> [f64; 2] {
    let at = Pose::new(sensor.x + beside[0], sensor.y + beside[1], sensor.theta + beside[2]);
    let located = at.transform(&seen.position);
    [located.x - seen.landmark.x, located.y - seen.landmark.y]
}

/// Normal equations of least squares, with numerical derivatives.
pub fn normal_equations(all: &[Seen], sensor: &Pose) -> (Matrix3<f64>, Vector3<f64>) {
    let (mut matrix, mut vector) = (Matrix3::zeros(), Vector3::zeros());
    for seen in all {
        let rotation = nalgebra::Rotation2::new(sensor.theta).matrix().to_owned();
        let covariance = rotation * seen.covariance * rotation.transpose() + Matrix2::identity() * 4e-6;
        let weight = covariance.try_inverse().unwrap();
        let zero = miss(seen, sensor, &[0.0; 3]);
        let mut jacobian = Matrix2x3::zeros();
        for axis in 0..3 {
            let mut beside = [0.0; 3];
            beside[axis] = 1e-6;
            let moved = miss(seen, sensor, &beside);
            for row in 0..2 {
                jacobian[(row, axis)] = (moved[row] - zero[row]) / 1e-6;
            }
        }
        matrix += jacobian.transpose() * weight * jacobian;
        vector -= jacobian.transpose() * weight * Vector2::from(zero);
    }
    (matrix, vector)
}

pub fn sum(all: &[Seen], sensor: &Pose) -> SensorInformation {
    all.iter().fold(SensorInformation::NONE, |sum, seen| sum.with(&SensorInformation::of(seen, sensor)))
}

#[test]
fn what_is_told_is_the_least_squares_fit_and_its_covariance() {
    let mut random = Random::new(1);
    for count in 1..8 {
        let sensor = Pose::new(random.uniform(-3.0, 3.0), 1.0, random.uniform(-3.0, 3.0));
        let all: Vec<Seen> = (0..count).map(|_| landmark(&mut random, &sensor, 0.01)).collect();
        let (matrix, vector) = normal_equations(&all, &sensor);
        let (mut again, mut told_vector) = (Matrix3::zeros(), Vector3::zeros());
        let told: Vec<_> = sum(&all, &sensor).told().into_iter().flatten().collect();
        assert_eq!(told.len(), if count == 1 { 2 } else { 3 }, "one landmark leaves a circle");
        for (row, value, variance) in told {
            again += row * row.transpose() / variance;
            told_vector += row * (value / variance);
        }
        assert!((again - matrix).norm() < 1e-4 * matrix.norm(), "{again} {matrix}");
        assert!((told_vector - vector).norm() < 1e-4 * vector.norm().max(1.0), "{told_vector} {vector}");
    }
}

#[test]
fn what_is_left_out_was_never_added() {
    let mut random = Random::new(2);
    let sensor = Pose::new(2.0, 1.0, 0.7);
    let all: Vec<Seen> = (0..6).map(|_| landmark(&mut random, &sensor, 0.01)).collect();
    let left = sum(&all, &sensor).without(&SensorInformation::of(&all[2], &sensor));
    let others: Vec<Seen> = all.iter().enumerate().filter(|(index, _)| *index != 2).map(|(_, seen)| *seen).collect();
    for (one, other) in left.told().iter().zip(sum(&others, &sensor).told()) {
        let (one, other) = (one.unwrap(), other.unwrap());
        assert!((one.0 - other.0).norm() < 1e-9 && (one.1 - other.1).abs() < 1e-9, "{one:?} {other:?}");
        assert!((one.2 / other.2 - 1.0).abs() < 1e-9);
    }
    let (square, freedom) = left.misfit();
    let (expected, expected_freedom) = sum(&others, &sensor).misfit();
    assert!((square / expected - 1.0).abs() < 1e-6 && freedom == expected_freedom, "{square} {expected} {freedom}");
    // So are the errors of the map.
    let (left, expected) = (left.map_variances(1.0).unwrap(), sum(&others, &sensor).map_variances(1.0).unwrap());
    assert!(
        (left.0 / expected.0 - 1.0).abs() < 1e-6 && (left.1 / expected.1 - 1.0).abs() < 1e-6,
        "{left:?} {expected:?}"
    );
}

/// The errors of a map that stay are those of weighted least squares: drawn, not computed.
#[test]
fn the_map_s_share_is_the_scatter_of_fits_in_wrong_maps() {
    let mut random = Random::new(3);
    let sensor = Pose::new(2.0, 1.0, 0.7);
    let all: Vec<Seen> = (0..4).map(|_| landmark(&mut random, &sensor, 0.0)).collect();
    assert_eq!(sum(&all[..1], &sensor).map_variances(1.0), None, "one landmark leaves a circle");
    let (position, heading) = sum(&all, &sensor).map_variances(1.0).unwrap();
    let (mut scatter, mut of_heading) = (Matrix2::zeros(), 0.0);
    const DRAWS: u32 = 20_000;
    for _ in 0..DRAWS {
        let wrong: Vec<Seen> = all
            .iter()
            .map(|seen| Seen {
                landmark: Point::new(
                    seen.landmark.x + 2e-3 * random.normal(),
                    seen.landmark.y + 2e-3 * random.normal(),
                ),
                ..*seen
            })
            .collect();
        let (matrix, vector) = normal_equations(&wrong, &sensor);
        let found = matrix.try_inverse().unwrap() * vector;
        let shift = nalgebra::Vector2::new(found[0], found[1]);
        scatter += shift * shift.transpose() / f64::from(DRAWS);
        of_heading += found[2] * found[2] / f64::from(DRAWS);
    }
    let largest = scatter.symmetric_eigenvalues().max();
    assert!((position / largest - 1.0).abs() < 0.05, "{position} {largest}");
    assert!((heading / of_heading - 1.0).abs() < 0.05, "{heading} {of_heading}");
}

#[test]
fn a_misfit_is_what_the_best_pose_leaves() {
    let mut random = Random::new(4);
    let sensor = Pose::new(2.0, 1.0, 0.7);
    for count in 1..8 {
        let all: Vec<Seen> = (0..count).map(|_| landmark(&mut random, &sensor, 0.02)).collect();
        let (square, freedom) = sum(&all, &sensor).misfit();
        let (matrix, vector) = normal_equations(&all, &sensor);
        // With one landmark the heading stays where it is.
        let beside = if count == 1 { Vector3::zeros() } else { matrix.try_inverse().unwrap() * vector };
        let rotation = nalgebra::Rotation2::new(sensor.theta).matrix().to_owned();
        let left: f64 = all
            .iter()
            .map(|seen| {
                let weight = rotation * seen.covariance * rotation.transpose() + Matrix2::identity() * 4e-6;
                // The model is linear in the small angle.
                let turned = rotation * seen.position;
                let by_turn = Vector2::new(-turned.y, turned.x) * beside[2];
                let miss = Vector2::from(miss(seen, &sensor, &[beside[0], beside[1], 0.0])) + by_turn;
                miss.dot(&(weight.try_inverse().unwrap() * miss))
            })
            .sum();
        assert_eq!(freedom, f64::from(2 * count - if count == 1 { 2 } else { 3 }));
        assert!(count == 1 && square < 1e-9 || (square - left).abs() < 1e-6 * left.max(1e-3), "{square} {left}");
    }
}

#[test]
fn the_means_are_those_of_the_landmarks() {
    let sensor = Pose::new(2.0, 1.0, 0.7);
    let seen = |x: f64, y: f64| Seen {
        position: Point::new(x, y),
        covariance: Matrix2::identity() * 5e-5,
        landmark: sensor.transform(&Point::new(x, y)),
        landmark_variance: 3e-5,
    };
    let (variance, distance) = sum(&[seen(3.0, 4.0), seen(-5.0, 12.0)], &sensor).means().unwrap();
    assert!((variance / 8e-5 - 1.0).abs() < 1e-9, "{variance}");
    assert!((distance / (0.5 * (25.0 + 169.0)) - 1.0).abs() < 1e-9, "{distance}");
    assert_eq!(SensorInformation::NONE.means(), None);
}

/// A whole pose is three numbers: with landmarks that tell the same three, all of them are left to contradict.
#[test]
fn a_pose_among_landmarks_has_three_degrees_of_freedom() {
    let mut random = Random::new(9);
    let sensor = Pose::new(2.0, 1.0, 0.7);
    let all: Vec<Seen> = (0..4).map(|_| landmark(&mut random, &sensor, 0.01)).collect();
    let landmarks = sum(&all, &sensor);
    assert_eq!(landmarks.misfit().1, 5.0);
    let covariance = Matrix3::from_diagonal(&Vector3::new(1e-4, 1e-4, 1e-6));
    let pose = SensorInformation::of_pose(&sensor, &covariance, &[0.0; 3], &sensor);
    assert_eq!(pose.misfit().1, 0.0);
    assert_eq!(landmarks.with(&pose).misfit().1, 8.0);
}
