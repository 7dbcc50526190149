//! One solution, against a filter of all its states.

use agv_core::geometry::{Point, Pose, difference};
use agv_core::integrity::separation::{AssumedDeviations, FAULT_FREE, Laser, Seen, Solution, Step};
use agv_core::odometry::BiasJacobian;
use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector3};

use super::sensor_information::{landmark, normal_equations, sum};
use crate::falko::scene::Random;

const STATES: usize = 10;

/// The model of a solution, written down once more: where R goes, and where the laser is when it sees.
struct Model {
    displacement: Pose,
    by_bias: BiasJacobian,
    mount: Pose,
    velocity: Vector3<f64>,
}

impl Model {
    fn go(&self, state: &[f64]) -> Vec<f64> {
        let d = &self.displacement;
        let by_turn = [0.0, 0.5 * d.x * d.theta, d.theta];
        let of = |axis: usize| {
            self.by_bias.scale[axis] * state[7] + self.by_bias.steering[axis] * state[8] + by_turn[axis] * state[9]
        };
        let displacement = Pose::new(d.x + of(0), d.y + of(1), d.theta + of(2));
        let pose = Pose::new(state[0], state[1], state[2]).compose(&displacement);
        let mut next = state.to_vec();
        next[..3].copy_from_slice(&[pose.x, pose.y, pose.theta]);
        next
    }

    fn sensor(&self, state: &[f64]) -> [f64; 3] {
        let mount = Pose::new(self.mount.x + state[3], self.mount.y + state[4], self.mount.theta + state[5]);
        let pose = Pose::new(state[0], state[1], state[2]).compose(&mount);
        let late = self.velocity * state[6];
        [pose.x - late.x, pose.y - late.y, pose.theta - late.z]
    }
}

fn derivative<const ROWS: usize>(function: impl Fn(&[f64]) -> Vec<f64>, at: &[f64]) -> SMatrix<f64, ROWS, STATES> {
    let base = function(at);
    SMatrix::from_fn(|row, column| {
        let mut moved = at.to_vec();
        moved[column] += 1e-6;
        (function(&moved)[row] - base[row]) / 1e-6
    })
}

#[test]
fn a_solution_is_a_kalman_filter_of_all_ten_states() {
    let mut random = Random::new(4);
    let assumed = AssumedDeviations::default();
    let start = Pose::new(1.0, 2.0, 0.5);
    let mut solution = Solution::new(start, &[4e-4, 1e-5, 3e-4, 2e-6, 1e-6, 1e-4], &assumed);
    solution.free_mounting();
    solution.free_odometry();
    let mut state = vec![start.x, start.y, start.theta, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let mut covariance = SMatrix::<f64, STATES, STATES>::zeros();
    for (row, column, value) in [(0, 0, 4e-4), (0, 1, 1e-5), (1, 1, 3e-4), (0, 2, 2e-6), (1, 2, 1e-6), (2, 2, 1e-4)] {
        covariance[(row, column)] = value;
        covariance[(column, row)] = value;
    }
    let deviations = [0.6, 0.6, 0.175, assumed.clock, 0.2, 0.1, 0.2];
    for (place, deviation) in (3..).zip(deviations) {
        covariance[(place, place)] = deviation * deviation;
    }
    let mount = Pose::new(0.9, 0.1, 0.2);
    for _ in 0..30 {
        let displacement = Pose::new(random.uniform(0.05, 0.2), 0.002, random.uniform(-0.1, 0.1));
        let by_bias = BiasJacobian::of(&displacement, Some(1.4));
        let noise = Matrix3::from_diagonal(&Vector3::new(4e-6, 1e-7, 2e-7));
        let velocity = Vector3::new(0.8, 0.5, 0.3);
        solution.predict(&Step { displacement, covariance: noise, by_bias });
        let model = Model { displacement, by_bias, mount, velocity };
        let forward = derivative::<STATES>(|state| model.go(state), &state);
        let turned = nalgebra::Rotation2::new(state[2]).matrix().to_owned();
        let mut rotated = Matrix3::zeros();
        rotated.fixed_view_mut::<2, 2>(0, 0).copy_from(&turned);
        rotated[(2, 2)] = 1.0;
        covariance = forward * covariance * forward.transpose();
        let mut block = covariance.fixed_view_mut::<3, 3>(0, 0);
        block += rotated * noise * rotated.transpose();
        state = model.go(&state);

        let expected = model.sensor(&state);
        let sensor = Pose::new(
            expected[0] + random.uniform(-0.003, 0.003),
            expected[1] + random.uniform(-0.003, 0.003),
            expected[2] + random.uniform(-0.001, 0.001),
        );
        let all: Vec<Seen> = (0..3).map(|_| landmark(&mut random, &sensor, 0.01)).collect();
        let square = solution.correct(&sum(&all, &sensor), &Laser { mount, sensor, velocity });

        let (matrix, vector) = normal_equations(&all, &sensor);
        let noise = matrix.try_inverse().unwrap();
        let fit = noise * vector;
        let by_state = derivative::<3>(|state| model.sensor(state).to_vec(), &state);
        let residual = SVector::<f64, 3>::from_fn(|axis, _| {
            let is = if axis == 2 {
                difference(expected[2], sensor.theta)
            } else {
                expected[axis] - [sensor.x, sensor.y][axis]
            };
            fit[axis] - is
        });
        let innovation = by_state * covariance * by_state.transpose() + noise;
        let inverse = innovation.try_inverse().unwrap();
        let gain = covariance * by_state.transpose() * inverse;
        let change = gain * residual;
        for (value, change) in state.iter_mut().zip(change.iter()) {
            *value += change;
        }
        covariance -= gain * by_state * covariance;
        let reference = (residual.transpose() * inverse * residual)[0];
        assert!((square - reference).abs() < 1e-3 * reference.max(1.0), "{square} {reference}");
        let off = solution.pose().between(&Pose::new(state[0], state[1], state[2]));
        assert!(off.x.hypot(off.y) < 1e-5 && off.theta.abs() < 1e-5, "{off:?}");
        let (position, heading) = solution.variances();
        let block = Matrix2::new(covariance[(0, 0)], covariance[(0, 1)], covariance[(1, 0)], covariance[(1, 1)]);
        let largest = block.symmetric_eigenvalues().max();
        assert!((position / largest - 1.0).abs() < 1e-2, "{position} {largest}");
        assert!((heading / covariance[(2, 2)] - 1.0).abs() < 1e-2, "{heading} {}", covariance[(2, 2)]);
    }
}

#[test]
fn solutions_lie_so_many_deviations_of_their_difference_apart() {
    let assumed = AssumedDeviations::default();
    let solution = |pose: Pose, covariance| Solution::new(pose, &covariance, &assumed);
    let surer = solution(Pose::new(1.0, 2.0, 3.1), [1e-4, 0.0, 1e-4, 0.0, 0.0, 1e-6]);
    // On one axis after the other, and across the seam of the angle.
    for (pose, deviations) in [
        (Pose::new(1.06, 2.0, 3.1), 3.0),
        (Pose::new(1.0, 1.92, 3.1), 2.0),
        (Pose::new(1.0, 2.0, 3.15 - std::f64::consts::TAU), 5.0),
        (Pose::new(1.06, 1.92, 3.1), f64::hypot(3.0, 2.0)),
    ] {
        let other = solution(pose, [5e-4, 0.0, 1.7e-3, 0.0, 0.0, 1.01e-4]);
        assert!((other.separation(&surer) - deviations).abs() < 1e-6, "{pose:?}: {}", other.separation(&surer));
    }
    // Who is hardly less sure counts with half of its own deviation.
    let other = solution(Pose::new(1.02, 2.0, 3.1), [1.01e-4, 0.0, 1.01e-4, 0.0, 0.0, 1.01e-6]);
    assert!((other.separation(&surer) - 0.02 / (0.5 * f64::sqrt(1.01e-4))).abs() < 1e-6);
}

#[test]
fn a_solution_that_is_not_a_number_bounds_nothing() {
    let assumed = AssumedDeviations::default();
    for covariance in [[f64::NAN, 0.0, 1e-4, 0.0, 0.0, 1e-5], [1e-4, 0.0, 1e-4, 0.0, 0.0, f64::NAN]] {
        let solution = Solution::new(Pose::default(), &covariance, &assumed);
        let level = solution.bound(&Pose::default(), &FAULT_FREE, (0.0, 0.0)).level();
        assert!(level.position > 1e6 && level.heading > 1e6, "{level:?}");
    }
}

/// The laser stands elsewhere than is believed; a pose that is known, on the spot where the vehicle turns, tells where.
#[test]
fn a_free_mounting_finds_where_the_laser_is() {
    let (mount, truth) = (Pose::new(0.8, 0.1, 0.0), Pose::new(0.95, -0.1, 0.04));
    let reflectors: Vec<Point> = (0..6).map(|number| Point::new(9.0 - 4.0 * f64::from(number), 7.0)).collect();
    let mut solution =
        Solution::new(Pose::default(), &[1e-8, 0.0, 1e-8, 0.0, 0.0, 1e-10], &AssumedDeviations::default());
    assert_eq!(solution.mounting_error(), (0.0, 0.0));
    solution.free_mounting();
    for _ in 0..8 {
        let sensor = truth;
        let see = |landmark: &Point| Seen {
            position: sensor.inverse_transform(landmark),
            covariance: Matrix2::identity() * 1e-6,
            landmark: *landmark,
            landmark_variance: 1e-9,
        };
        let all: Vec<Seen> = reflectors.iter().map(see).collect();
        let believed = solution.pose().compose(&mount);
        let laser = Laser { mount, sensor: believed, velocity: Vector3::zeros() };
        let _ = solution.correct(&sum(&all, &believed), &laser);
    }
    let (place, yaw) = solution.mounting_error();
    let expected = 0.15_f64.hypot(0.2);
    assert!((place - expected).abs() < 0.01 && (yaw - 0.04).abs() < 2e-3, "{place} m, {yaw} rad");
}

#[test]
fn a_solution_says_the_covariance_that_it_was_given() {
    let entries = [4e-4, 1e-5, 3e-4, 2e-6, 1e-6, 1e-4];
    let solution = Solution::new(Pose::new(1.0, 2.0, 0.5), &entries, &AssumedDeviations::default());
    for (said, given) in solution.entries().iter().zip(entries) {
        assert!((said - given).abs() < 1e-15, "{said} {given}");
    }
}

/// What a free odometry may do on the next metres is what the prediction makes of it.
#[test]
fn the_drift_of_a_solution_is_what_its_prediction_adds() {
    for lever in [None, Some(1.2)] {
        let mut solution =
            Solution::new(Pose::default(), &[1e-8, 0.0, 1e-8, 0.0, 0.0, 1e-10], &AssumedDeviations::default());
        solution.free_odometry();
        for (along, turned) in [(0.2, 0.0), (0.2, 0.05), (-0.1, 0.03)] {
            let displacement = Pose::new(along, 0.0, turned);
            let by_bias = BiasJacobian::of(&displacement, lever);
            let drift = solution.odometry_errors().drift(&by_bias, turned);
            let mut moved = solution.clone();
            moved.predict(&Step { displacement, covariance: Matrix3::zeros(), by_bias });
            let [before, after] = [&solution, &moved].map(Solution::variances);
            let heading = after.1 - before.1;
            assert!((drift.heading_variance / heading - 1.0).abs() < 1e-6, "{lever:?} {turned}: {drift:?} {heading}");
            // Deviations of the position are added up; what moves the vehicle to the side is of second order.
            let (position, at_most) = (after.0.sqrt(), before.0.sqrt() + drift.deviation);
            assert!(at_most > 0.99 * position, "{lever:?} {turned}: {drift:?} {position}");
            assert!(at_most < 1.05 * position || along < 0.0, "{lever:?} {turned}: {drift:?} {position}");
            assert_eq!(drift.expected, (0.0, 0.0));
            // The second time they are correlated with the heading.
            solution = moved;
        }
    }
}
