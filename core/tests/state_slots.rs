//! The filter with slots against a dense one, and its consistency.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is how a test fails")]

use agv_core::filter::{
    BiasDeviations, BiasModel, BiasWalk, Cartesian, Ekf, Landmark, PoseAndSlots, RelativePose, packed_entries,
    slot_states,
};
use agv_core::geometry::{Point, Pose, wrap};
use agv_core::measurement::{LaserId, Time};
use agv_core::odometry::{Motion, OdometryBias};
use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector2, Vector3};
use proptest::prelude::*;

use super::support::view::observe;

const KEYS: usize = 2;
const LANDMARKS: usize = 4;
const STATES: usize = slot_states(KEYS, LANDMARKS);
type Filter = Ekf<PoseAndSlots<KEYS, LANDMARKS, STATES, { packed_entries(STATES) }>>;

const LASER: Pose = Pose { x: 0.9, y: -0.1, theta: 0.2 };
const LEVER: Option<f64> = Some(1.5);
const YAW: usize = 5;

fn key(slot: usize) -> usize {
    6 + 3 * slot
}

fn landmark(slot: usize) -> usize {
    6 + 3 * KEYS + 2 * slot
}

fn deviations() -> BiasDeviations {
    BiasDeviations { scale: 0.01, steering: 0.005, laser_yaw: 0.002 }
}

const WALK: BiasWalk = BiasWalk { scale: 1e-3, steering: 7e-4, laser_yaw: 4e-4 };

fn motion(x: f64, y: f64, theta: f64) -> Motion {
    Motion {
        displacement: Pose::new(x, y, theta),
        distance: x.hypot(y),
        covariance: Matrix3::from_diagonal(&Vector3::new(1e-6, 2e-6, 1e-7)),
        ..Motion::none(Time::from_micros(0))
    }
}

fn seen(x: f64, y: f64) -> Cartesian {
    Cartesian { position: Point::new(x, y), covariance: Matrix2::new(4e-5, 1e-5, 1e-5, 3e-5) }
}

type Mean = SVector<f64, STATES>;
type Square = SMatrix<f64, STATES, STATES>;

/// The same filter with dense matrices, derivatives as finite differences, and Joseph's form.
struct Dense {
    mean: Mean,
    /// The mean with positions as they were first estimated.
    anchor: Mean,
    covariance: Square,
}

impl Dense {
    fn new(start: &Ekf) -> Self {
        let mut mean = Mean::zeros();
        mean[0] = start.pose.x;
        mean[1] = start.pose.y;
        mean[2] = start.pose.theta;
        let mut covariance = Square::zeros();
        covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(&start.covariance());
        let biases = deviations();
        for (state, deviation) in [(3, biases.scale), (4, biases.steering), (YAW, biases.laser_yaw)] {
            covariance[(state, state)] = deviation * deviation;
        }
        Self { anchor: mean, mean, covariance }
    }

    /// Where derivatives are taken: headings and biases as they are, positions as they were first estimated.
    fn linearisation_point(&self) -> Mean {
        let mut point = self.anchor;
        for state in [2, 3, 4, YAW, key(0) + 2, key(1) + 2] {
            point[state] = self.mean[state];
        }
        point
    }

    fn jacobian<const SIZE: usize>(&self, model: impl Fn(&Mean) -> SVector<f64, SIZE>) -> SMatrix<f64, SIZE, STATES> {
        let at = self.linearisation_point();
        let step = 1e-6;
        let mut jacobian = SMatrix::<f64, SIZE, STATES>::zeros();
        for state in 0..STATES {
            let moved = |by: f64| {
                let mut point = at;
                point[state] += by;
                model(&point)
            };
            jacobian.set_column(state, &((moved(step) - moved(-step)) / (2.0 * step)));
        }
        jacobian
    }

    fn predict(&mut self, motion: &Motion) {
        let pose = pose(&self.mean, 0);
        let ahead = pose.compose(&motion.displacement);
        let mut transition = Square::identity();
        transition[(0, 2)] = -(ahead.y - self.anchor[1]);
        transition[(1, 2)] = ahead.x - self.anchor[0];
        let step = 1e-6;
        for (state, bias) in
            [(3, OdometryBias { scale: step, steering: 0.0 }), (4, OdometryBias { scale: 0.0, steering: step })]
        {
            let biased = pose.compose(&motion.corrected(&bias, LEVER).displacement);
            transition[(0, state)] = (biased.x - ahead.x) / step;
            transition[(1, state)] = (biased.y - ahead.y) / step;
            transition[(2, state)] = wrap(biased.theta - ahead.theta) / step;
        }
        let mut noise = Square::zeros();
        let turn = pose.compose_jacobian_second();
        noise.fixed_view_mut::<3, 3>(0, 0).copy_from(&(turn * motion.covariance * turn.transpose()));
        for (state, deviation) in [(3, WALK.scale), (4, WALK.steering), (YAW, WALK.laser_yaw)] {
            noise[(state, state)] = f64::from(deviation).powi(2) * motion.distance;
        }
        self.covariance = transition * self.covariance * transition.transpose() + noise;
        for (state, value) in [ahead.x, ahead.y, ahead.theta].into_iter().enumerate() {
            self.mean[state] = value;
            self.anchor[state] = value;
        }
    }

    fn correct<const SIZE: usize>(
        &mut self,
        observed: &SVector<f64, SIZE>,
        noise: &SMatrix<f64, SIZE, SIZE>,
        model: impl Fn(&Mean) -> SVector<f64, SIZE>,
    ) {
        let jacobian = self.jacobian(&model);
        let innovation = jacobian * self.covariance * jacobian.transpose() + noise;
        let gain = self.covariance * jacobian.transpose() * innovation.try_inverse().unwrap();
        let mut residual = observed - model(&self.mean);
        if SIZE == 3 {
            residual[2] = wrap(residual[2]);
        }
        self.mean += gain * residual;
        let remaining = Square::identity() - gain * jacobian;
        self.covariance = remaining * self.covariance * remaining.transpose() + gain * noise * gain.transpose();
    }

    fn forget(&mut self, states: std::ops::Range<usize>) {
        for state in states {
            self.covariance.row_mut(state).fill(0.0);
            self.covariance.column_mut(state).fill(0.0);
        }
    }

    fn add_landmark(&mut self, slot: usize, seen: &Cartesian) {
        let state = landmark(slot);
        let model = |at: &Mean| locate(at, &seen.position);
        let mut jacobian = Square::identity();
        jacobian.fixed_view_mut::<2, STATES>(state, 0).copy_from(&self.jacobian(model));
        self.forget(state..state + 2);
        self.covariance = jacobian * self.covariance * jacobian.transpose();
        let sensor = self.mean[2] + LASER.theta + self.mean[YAW];
        let turn = Matrix2::new(sensor.cos(), -sensor.sin(), sensor.sin(), sensor.cos());
        let mut own = self.covariance.fixed_view_mut::<2, 2>(state, state);
        own += turn * seen.covariance * turn.transpose();
        let (mean, anchor) = (locate(&self.mean, &seen.position), locate(&self.linearisation_point(), &seen.position));
        for axis in 0..2 {
            self.mean[state + axis] = mean[axis];
            self.anchor[state + axis] = anchor[axis];
        }
    }

    fn remember_pose(&mut self, slot: usize) {
        let state = key(slot);
        let mut copy = Square::identity();
        for axis in 0..3 {
            copy[(state + axis, state + axis)] = 0.0;
            copy[(state + axis, axis)] = 1.0;
            self.mean[state + axis] = self.mean[axis];
            self.anchor[state + axis] = self.anchor[axis];
        }
        self.covariance = copy * self.covariance * copy.transpose();
    }

    /// A past pose goes on by the way between it and the present one, which is taken for exact.
    fn carry_pose(&mut self, slot: usize, doubt: &Matrix3<f64>) {
        let (state, point) = (key(slot), self.linearisation_point());
        let way = sensor(&point, state).between(&sensor(&point, 0));
        let carried = |at: &Mean| {
            let mounted = Pose { theta: LASER.theta + at[YAW], ..LASER };
            let carried = sensor(at, state).compose(&way).compose(&mounted.inverse());
            Vector3::new(carried.x, carried.y, carried.theta)
        };
        let mut jacobian = Square::identity();
        jacobian.fixed_view_mut::<3, STATES>(state, 0).copy_from(&self.jacobian(carried));
        self.covariance = jacobian * self.covariance * jacobian.transpose();
        let mut own = self.covariance.fixed_view_mut::<3, 3>(state, state);
        own += doubt;
        for axis in 0..3 {
            self.mean[state + axis] = self.mean[axis];
            self.anchor[state + axis] = self.anchor[axis];
        }
    }
}

fn pose(at: &Mean, state: usize) -> Pose {
    Pose { x: at[state], y: at[state + 1], theta: at[state + 2] }
}

fn sensor(at: &Mean, state: usize) -> Pose {
    pose(at, state).compose(&Pose { theta: LASER.theta + at[YAW], ..LASER })
}

fn locate(at: &Mean, seen: &Point) -> Vector2<f64> {
    sensor(at, 0).transform(seen)
}

fn sight(at: &Mean, slot: usize) -> Vector2<f64> {
    let state = landmark(slot);
    sensor(at, 0).inverse_transform(&Point::new(at[state], at[state + 1]))
}

fn way(at: &Mean, slot: usize) -> Vector3<f64> {
    let between = sensor(at, key(slot)).between(&sensor(at, 0));
    Vector3::new(between.x, between.y, between.theta)
}

#[derive(Clone, Copy, Debug)]
enum Step {
    Move(f64, f64, f64),
    Add(usize, f64, f64),
    Remove(usize),
    See(usize, f64, f64),
    Remember(usize),
    Carry(usize, f64),
    Align(usize, f64, f64, f64),
}

fn step() -> impl Strategy<Value = Step> {
    let error = -0.01f64..0.01;
    prop_oneof![
        4 => (-0.2f64..0.2, -0.01f64..0.01, -0.1f64..0.1).prop_map(|(x, y, theta)| Step::Move(x, y, theta)),
        2 => (0..LANDMARKS, -8.0f64..8.0, -8.0f64..8.0).prop_map(|(slot, x, y)| Step::Add(slot, x, y)),
        1 => (0..LANDMARKS).prop_map(Step::Remove),
        4 => (0..LANDMARKS, error.clone(), error.clone()).prop_map(|(slot, x, y)| Step::See(slot, x, y)),
        1 => (0..KEYS).prop_map(Step::Remember),
        1 => (0..KEYS, 0.0f64..0.01).prop_map(|(slot, deviation)| Step::Carry(slot, deviation)),
        2 => (0..KEYS, error.clone(), error.clone(), error).prop_map(|(slot, x, y, t)| Step::Align(slot, x, y, 0.1 * t)),
    ]
}

fn start() -> (Filter, Dense) {
    let state = Ekf::new(Pose::new(3.0, -2.0, 0.7), 0.01, 0.005);
    let mut filter = Filter::empty();
    filter.begin_biases(&deviations());
    filter.begin(&state);
    (filter, Dense::new(&state))
}

fn dense_covariance(filter: &Filter) -> Square {
    Square::from_fn(|row, column| filter.packed_covariance().get(row, column))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn it_agrees_with_a_dense_filter(steps in proptest::collection::vec(step(), 1..40)) {
        let (mut filter, mut dense) = start();
        for step in steps {
            match step {
                Step::Move(x, y, theta) => {
                    filter.predict_with(&motion(x, y, theta), &BiasModel { lever: LEVER, walk: WALK });
                    dense.predict(&motion(x, y, theta));
                }
                Step::Add(slot, x, y) => {
                    filter.add_landmark(slot, &filter.viewpoint(LaserId::FIRST, &LASER), &seen(x, y));
                    dense.add_landmark(slot, &seen(x, y));
                }
                Step::Remove(slot) => {
                    filter.remove_landmark(slot);
                    dense.forget(landmark(slot)..landmark(slot) + 2);
                }
                Step::See(slot, x, y) => {
                    let expected = sight(&dense.mean, slot);
                    let observation = seen(expected[0] + x, expected[1] + y);
                    if let Some(linearised) = observe(&filter, &LASER, &observation, Landmark::Slot(slot)) {
                        prop_assert!(filter.correct(&linearised));
                        dense.correct(&observation.position, &observation.covariance, |at| sight(at, slot));
                    }
                }
                Step::Remember(slot) => {
                    filter.remember_pose(slot);
                    dense.remember_pose(slot);
                }
                Step::Carry(slot, deviation) => {
                    if filter.past_pose(slot).is_some() {
                        let doubt = Matrix3::new(2.0, 0.3, -0.1, 0.3, 1.0, 0.2, -0.1, 0.2, 0.5) * deviation * deviation;
                        filter.carry_past_pose(slot, &LASER);
                        filter.doubt_past_pose(slot, &doubt);
                        dense.carry_pose(slot, &doubt);
                    }
                }
                Step::Align(slot, x, y, theta) => {
                    let expected = way(&dense.mean, slot);
                    let seen = RelativePose {
                        pose: Pose::new(expected[0] + x, expected[1] + y, expected[2] + theta),
                        covariance: Matrix3::from_diagonal(&Vector3::new(1e-5, 2e-5, 1e-6)),
                    };
                    if let Some(linearised) = filter.observe_relative_pose(slot, &seen, &LASER) {
                        prop_assert!(filter.correct(&linearised));
                        let observed = Vector3::new(seen.pose.x, seen.pose.y, seen.pose.theta);
                        dense.correct(&observed, &seen.covariance, |at| way(at, slot));
                    }
                }
            }
            let covariance = dense_covariance(&filter);
            let difference = (covariance - dense.covariance).abs().max();
            prop_assert!(difference < 1e-9, "{step:?}: {difference}");
            let state = filter.state();
            prop_assert!((state.pose.position() - Point::new(dense.mean[0], dense.mean[1])).norm() < 1e-7);
            prop_assert!(wrap(state.pose.theta - dense.mean[2]).abs() < 1e-8);
            prop_assert!((filter.bias().scale - dense.mean[3]).abs() < 1e-7);
            prop_assert!((filter.bias().steering - dense.mean[4]).abs() < 1e-7);
            prop_assert!((filter.laser_yaw() - dense.mean[YAW]).abs() < 1e-7);
            let free = Square::identity() * 1e-12;
            prop_assert!((covariance + free).cholesky().is_some(), "{step:?}: not positive");
        }
    }
}

#[test]
fn a_known_landmark_is_not_learnt_better_than_the_map_states() {
    // Twice the same landmark, a thousand times: its own error stays in the pose.
    let (mut filter, _) = start();
    let there = filter.viewpoint(LaserId::FIRST, &LASER).locate(&Point::new(4.0, 1.0));
    filter.add_known_landmark(0, there, 1e-4);
    for _ in 0..1000 {
        let linearised = observe(&filter, &LASER, &seen(4.0, 1.0), Landmark::Slot(0)).unwrap();
        assert!(filter.correct(&linearised));
    }
    let state = filter.state();
    // The landmark's variance and the start pose's, with little from the heading.
    let expected = 1.0 / (1.0 / 1e-4 + 1.0 / 1e-4);
    assert!(state.covariance().m11 > 0.9 * expected && state.covariance().m22 > 0.9 * expected, "{state:?}");
}

/// Normally distributed numbers from a fixed sequence.
struct Normal(u64);

impl Normal {
    fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn next(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// A vehicle among four landmarks that it has found itself, with all noise as the filter believes it. Calls `check` after
/// each scan with the filter and the true pose.
fn wander(run: u64, turns: usize, speed: f64, turn: f64, start_deviation: f64, mut check: impl FnMut(&Filter, &Pose)) {
    let mut random = Normal(0x9E37_79B9_7F4A_7C15_u64.wrapping_mul(2 * run + 1));
    let landmarks = [(4.0, 1.0), (-3.0, 5.0), (1.0, -6.0), (7.0, 6.0)].map(|(x, y)| Point::new(x, y));
    let mut truth = Pose::default();
    let begin = Pose::new(0.01 * random.next(), 0.01 * random.next(), start_deviation * random.next());
    let mut filter = Filter::empty();
    filter.begin_biases(&deviations());
    filter.begin(&Ekf::new(begin, 0.01, start_deviation));
    let biases = deviations();
    let bias = OdometryBias { scale: biases.scale * random.next(), steering: biases.steering * random.next() };
    let yaw = biases.laser_yaw * random.next();
    for scan in 0..turns {
        let reported = motion(speed, 0.0, turn);
        // The filter takes its own estimate of the bias from what is reported.
        let believed = reported.corrected(&filter.bias(), LEVER);
        let deviation = reported.covariance.diagonal().map(f64::sqrt);
        let noise = [deviation.x, deviation.y, deviation.z].map(|deviation| deviation * random.next());
        let moved = reported.corrected(&bias, LEVER).displacement;
        truth = truth.compose(&Pose::new(moved.x + noise[0], moved.y + noise[1], moved.theta + noise[2]));
        filter.predict_with(&believed, &BiasModel { lever: LEVER, walk: BiasWalk::NONE });
        let sensor = truth.compose(&Pose { theta: LASER.theta + yaw, ..LASER });
        for (slot, point) in landmarks.iter().enumerate() {
            let exact = sensor.inverse_transform(point);
            let observation = Cartesian {
                position: exact + Point::new(0.005 * random.next(), 0.005 * random.next()),
                covariance: Matrix2::identity() * 2.5e-5,
            };
            if scan == 0 {
                filter.add_landmark(slot, &filter.viewpoint(LaserId::FIRST, &LASER), &observation);
            } else {
                let linearised = observe(&filter, &LASER, &observation, Landmark::Slot(slot)).unwrap();
                assert!(filter.correct(&linearised));
            }
        }
        check(&filter, &truth);
    }
}

#[test]
fn the_heading_is_never_known_better_than_at_the_start() {
    // Landmarks that the vehicle has found itself say nothing of the angle of the whole map.
    for (speed, turn) in [(0.0, 0.0), (0.1, 0.08)] {
        for start in [0.002, 0.1] {
            for run in 1..6 {
                wander(run, 200, speed, turn, start, |filter, _| {
                    let variance = filter.covariance().m33;
                    assert!(variance >= 0.999_999 * start * start, "{variance} from {}", start * start);
                });
            }
        }
    }
}

#[test]
fn errors_are_as_large_as_the_filter_says() {
    for (speed, turn) in [(0.0, 0.0), (0.1, 0.08)] {
        let (mut sum, runs) = (0.0, 100);
        for run in 1..=runs {
            let mut last = 0.0;
            wander(run, 80, speed, turn, 0.02, |filter, truth| {
                let state = filter.state();
                let error =
                    Vector3::new(state.pose.x - truth.x, state.pose.y - truth.y, wrap(state.pose.theta - truth.theta));
                last = (error.transpose() * state.covariance().try_inverse().unwrap() * error).x;
            });
            sum += last;
        }
        // Chi-square with three degrees of freedom, a hundred times: 99.9 per cent.
        let mean = sum / runs as f64;
        assert!((2.24..3.87).contains(&mean), "NEES {mean} at {speed} m a scan");
    }
}
