//! Bias and scale of a gyro, against a filter with all states.

use agv_core::filter::{GyroState, KnownPose};
use agv_core::geometry::{Pose, Twist};
use agv_core::measurement::Time;
use agv_core::odometry::{GyroErrors, GyroTurn, Motion};
use nalgebra::{Matrix3, Matrix5, Vector5};

use super::random::{FITTED, Random};

/// A filter with all five states, with dense matrices and derivatives by differences.
struct Whole {
    state: Vector5<f64>,
    covariance: Matrix5<f64>,
}

impl Whole {
    fn step(&self, state: &Vector5<f64>, wheels: &Motion, turn: &GyroTurn) -> Vector5<f64> {
        let errors = GyroErrors { bias: state[3], scale: state[4] };
        let moved = wheels.with_turn(turn.corrected(&errors), 0.0);
        let pose = Pose { x: state[0], y: state[1], theta: state[2] };
        let (sine, cosine) = pose.theta.sin_cos();
        let Pose { x, y, theta } = moved.displacement;
        Vector5::new(
            pose.x + cosine * x - sine * y,
            pose.y + sine * x + cosine * y,
            pose.theta + theta,
            state[3],
            state[4],
        )
    }

    fn predict(&mut self, wheels: &Motion, turn: &GyroTurn, noise: f64, drift: f64) {
        let mut jacobian = Matrix5::zeros();
        for axis in 0..5 {
            let mut change = Vector5::zeros();
            change[axis] = 1e-6;
            let (more, less) = (self.state + change, self.state - change);
            jacobian.set_column(axis, &((self.step(&more, wheels, turn) - self.step(&less, wheels, turn)) / 2e-6));
        }
        let errors = GyroErrors { bias: self.state[3], scale: self.state[4] };
        let own = wheels.with_turn(turn.corrected(&errors), noise).covariance;
        let (sine, cosine) = self.state[2].sin_cos();
        let turned = Matrix3::new(cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0);
        let own = turned * own * turned.transpose();
        self.state = self.step(&self.state, wheels, turn);
        self.covariance = jacobian * self.covariance * jacobian.transpose();
        for row in 0..3 {
            for column in 0..3 {
                self.covariance[(row, column)] += own[(row, column)];
            }
        }
        self.covariance[(3, 3)] += drift * drift * turn.duration;
    }

    /// A pose that is told with that covariance.
    fn correct(&mut self, told: &Pose, noise: &Matrix3<f64>) {
        let block = self.covariance.fixed_view::<3, 3>(0, 0) + noise;
        let gain = self.covariance.fixed_columns::<3>(0) * block.try_inverse().unwrap();
        let rest = nalgebra::Vector3::new(told.x - self.state[0], told.y - self.state[1], told.theta - self.state[2]);
        self.state += gain * rest;
        self.covariance -= gain * self.covariance.fixed_rows::<3>(0);
    }

    fn known(&self) -> KnownPose {
        KnownPose {
            pose: Pose { x: self.state[0], y: self.state[1], theta: self.state[2] },
            covariance: self.covariance.fixed_view::<3, 3>(0, 0).into_owned(),
        }
    }
}

#[test]
fn bias_and_scale_are_those_of_a_filter_with_all_states() {
    let mut random = Random(5);
    let mut state = GyroState::new(&FITTED);
    let priors = [4e-4, 4e-4, 1e-4, FITTED.bias * FITTED.bias, FITTED.scale * FITTED.scale];
    let mut whole = Whole {
        state: Vector5::new(1.0, 2.0, 0.3, 0.0, 0.0),
        covariance: Matrix5::from_diagonal(&Vector5::from_row_slice(&priors)),
    };
    let (bias, scale) = (6e-3, -2e-3);
    for step in 0..2000 {
        let curvature = if step % 700 < 350 { 0.4 } else { -0.2 };
        let (duration, way) = (0.01_f64, 0.01);
        let turn = curvature * way;
        let displacement = Pose::exp(&Twist { x: way, y: 0.0, theta: turn });
        let (start, end) = (Time::from_micros(10_000 * step), Time::from_micros(10_000 * (step + 1)));
        let covariance = Matrix3::from_diagonal(&nalgebra::Vector3::new(3e-7, 1e-8, 1e-8));
        let wheels = Motion { start, end, displacement, covariance, distance: way };
        let noise = FITTED.noise * duration.sqrt();
        let angle = turn / (1.0 + scale) + bias * duration + noise * random.normal();
        let told = GyroTurn { angle, duration, variance: 0.0 };
        let motion = wheels.with_turn(told.corrected(state.errors()), noise * noise);
        let before = whole.known();
        // What the joint states add is what the pose of the whole filter has more than without them.
        let added = state.predict(before.pose.theta, &motion.displacement, duration, Some(&told));
        whole.predict(&wheels, &told, noise * noise, FITTED.drift);
        let alone = {
            let Pose { x, y, .. } = motion.displacement;
            let (sine, cosine) = before.pose.theta.sin_cos();
            let moved =
                Matrix3::new(1.0, 0.0, -(sine * x + cosine * y), 0.0, 1.0, cosine * x - sine * y, 0.0, 0.0, 1.0);
            let turned = Matrix3::new(cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0);
            moved * before.covariance * moved.transpose() + turned * (motion.covariance + added) * turned.transpose()
        };
        assert!((alone - whole.known().covariance).amax() < 1e-9 * whole.known().covariance.amax() + 1e-13);
        if step % 12 == 11 {
            let before = whole.known();
            let deviations = [5e-3, 5e-3, 1e-3];
            let seen = Pose {
                x: whole.state[0] + deviations[0] * random.normal(),
                y: whole.state[1] + deviations[1] * random.normal(),
                theta: whole.state[2] + deviations[2] * random.normal(),
            };
            let noise = Matrix3::from_diagonal(&nalgebra::Vector3::from(deviations.map(|one| one * one)));
            whole.correct(&seen, &noise);
            state.correct(&before, &whole.known());
        }
        let GyroErrors { bias, scale } = *state.errors();
        let own = state.covariance();
        assert!((bias - whole.state[3]).abs() < 1e-7 * FITTED.bias + 1e-9, "{step}: {bias} {}", whole.state[3]);
        assert!((scale - whole.state[4]).abs() < 1e-6 * FITTED.scale + 1e-8, "{step}: {scale} {}", whole.state[4]);
        assert!((own.m11 - whole.covariance[(3, 3)]).abs() < 1e-6 * whole.covariance[(3, 3)], "{step}");
        assert!((own.m22 - whole.covariance[(4, 4)]).abs() < 1e-6 * whole.covariance[(4, 4)], "{step}");
        assert!(own.m11 > 0.0);
    }
}

#[test]
fn a_bias_that_nothing_tells_is_known_to_twice_its_prior_at_least() {
    let mut gyro = GyroState::new(&FITTED);
    let long = GyroTurn { angle: 0.0, duration: 1e5, variance: 0.0 };
    for hours in 1..200 {
        let _ = gyro.predict(0.0, &Pose::default(), 1e5, Some(&long));
        let walked = FITTED.bias.powi(2) + FITTED.drift.powi(2) * 1e5 * f64::from(hours);
        let expected = walked.sqrt().min(2.0 * FITTED.bias);
        assert!((gyro.deviations().0 / expected - 1.0).abs() < 1e-9, "{hours}: {:?} {expected}", gyro.deviations());
    }
    assert_eq!(gyro.deviations().0, 2.0 * FITTED.bias);
}

#[test]
fn rest_with_a_variance_that_is_no_number_tells_nothing() {
    let fresh = GyroState::new(&FITTED);
    for variance in [f64::NAN, f64::INFINITY, -FITTED.bias.powi(2), -1.0] {
        let mut gyro = fresh;
        gyro.see_rest(0.004, variance);
        assert_eq!((gyro.errors(), gyro.covariance()), (fresh.errors(), fresh.covariance()), "{variance}");
    }
}

/// What is known of a gyro that has told a turn to the left and, faster, one to the right: bias and scale are correlated with the pose,
/// each in its own way.
fn turned() -> GyroState {
    let mut state = GyroState::new(&FITTED);
    for (angle, duration) in [(1.0, 4.0), (-0.5, 0.3)] {
        let turn = GyroTurn { angle, duration, variance: 0.0 };
        let _ = state.predict(0.3, &Pose::new(1.0, 0.1, angle), duration, Some(&turn));
    }
    state
}

fn known(x: f64, theta: f64, variance: f64) -> KnownPose {
    KnownPose { pose: Pose::new(x, 0.0, theta), covariance: Matrix3::identity() * variance }
}

/// A pose that is said to be far surer than what the gyro has told of it would leave bias and scale with negative variances.
#[test]
fn a_correction_that_no_covariance_allows_changes_nothing() {
    let mut state = turned();
    let (errors, covariance) = (*state.errors(), *state.covariance());
    state.correct(&known(0.0, 0.0, 1e-9), &known(0.01, 0.01, 1e-12));
    assert_eq!((state.errors(), state.covariance()), (&errors, &covariance));
    state.correct(&known(0.0, 0.0, 1e-2), &known(0.01, 0.01, f64::NAN));
    assert_eq!((state.errors(), state.covariance()), (&errors, &covariance));
    // A sound one changes both.
    state.correct(&known(0.0, 0.0, 1e-2), &known(0.01, 0.01, 1e-3));
    assert!(state.errors().bias != errors.bias && state.errors().scale != errors.scale);
    assert!(state.covariance().m11 < covariance.m11 && state.covariance().m22 < covariance.m22);
}

#[test]
fn a_pose_that_begins_anew_says_nothing_of_the_gyro() {
    let mut state = turned();
    state.begin_pose();
    let (errors, covariance) = (*state.errors(), *state.covariance());
    state.correct(&known(0.0, 0.0, 1e-2), &known(0.01, 0.01, 1e-3));
    assert_eq!((state.errors(), state.covariance()), (&errors, &covariance));
}
