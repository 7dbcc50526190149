//! Slots of the filter: how they are taken and freed, and what an observation without a slot says.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use agv_core::filter::{
    BiasDeviations, Cartesian, Ekf, Landmark, Linearisation, PoseAndSlots, RelativePose, packed_entries, slot_states,
};
use agv_core::geometry::{Point, Pose};
use agv_core::measurement::LaserId;
use nalgebra::{Matrix2, Matrix3, SMatrix, Vector2};

use super::support::view::observe;

const KEYS: usize = 2;
const LANDMARKS: usize = 3;
const STATES: usize = slot_states(KEYS, LANDMARKS);
type Filter = Ekf<PoseAndSlots<KEYS, LANDMARKS, STATES, { packed_entries(STATES) }>>;
type Square = SMatrix<f64, STATES, STATES>;

const LASER: Pose = Pose { x: 0.9, y: -0.1, theta: 0.2 };
const BIASES: BiasDeviations = BiasDeviations { scale: 0.01, steering: 0.005, laser_yaw: 0.002 };

fn state(pose: Pose) -> Ekf {
    let covariance = Matrix3::new(4e-4, 1e-4, 2e-5, 1e-4, 3e-4, -1e-5, 2e-5, -1e-5, 1e-4);
    Ekf::with_covariance(pose, &covariance)
}

fn seen(x: f64, y: f64) -> Cartesian {
    Cartesian { position: Point::new(x, y), covariance: Matrix2::new(4e-5, 1e-5, 1e-5, 3e-5) }
}

fn known(filter: &Filter, position: Point, variance: f64, seen: &Cartesian) -> Linearisation<2> {
    observe(filter, &LASER, seen, Landmark::Known { position, variance }).unwrap()
}

fn begun() -> Filter {
    let mut filter = Filter::empty();
    filter.begin_biases(&BIASES);
    filter.begin(&state(Pose::new(3.0, -2.0, 0.7)));
    filter
}

/// All places taken, and everything correlated with everything.
fn full() -> Filter {
    let mut filter = begun();
    for key in 0..KEYS {
        filter.remember_pose(key);
    }
    for landmark in 0..LANDMARKS {
        filter.add_landmark(
            landmark,
            &filter.viewpoint(LaserId::FIRST, &LASER),
            &seen(4.0 - 3.0 * landmark as f64, 2.0),
        );
    }
    let known =
        known(&filter, filter.viewpoint(LaserId::FIRST, &LASER).locate(&Point::new(3.0, 1.0)), 1e-4, &seen(3.01, 1.02));
    assert!(filter.correct(&known));
    filter
}

fn covariance(filter: &Filter) -> Square {
    Square::from_fn(|row, column| filter.packed_covariance().get(row, column))
}

#[test]
fn a_filter_has_six_states_of_its_own_and_three_a_pose_and_two_a_landmark() {
    assert_eq!([(0, 0), (1, 0), (0, 1), (4, 64)].map(|(keys, places)| slot_states(keys, places)), [6, 9, 8, 146]);
    assert_eq!([0, 1, 2, 3, 146].map(packed_entries), [0, 1, 3, 6, 10_731]);
}

#[test]
fn a_new_beginning_keeps_what_is_known_of_the_biases_and_nothing_else() {
    let mut filter = full();
    let before = covariance(&filter);
    assert!(before.fixed_view::<3, 3>(0, 3).iter().any(|entry| *entry != 0.0), "yaw and pose are correlated");
    let (bias, yaw) = (filter.bias(), filter.laser_yaw());
    assert!(yaw != 0.0);
    let new = state(Pose::new(-1.0, 4.0, 2.5));
    filter.begin(&new);
    assert_eq!((filter.state(), filter.bias(), filter.laser_yaw()), (new, bias, yaw));
    let mut expected = Square::zeros();
    expected.fixed_view_mut::<3, 3>(0, 0).copy_from(&new.covariance());
    expected.fixed_view_mut::<3, 3>(3, 3).copy_from(&before.fixed_view::<3, 3>(3, 3));
    assert_eq!(covariance(&filter), expected);
    assert!((0..KEYS).all(|key| filter.past_pose(key).is_none()));
    assert!((0..LANDMARKS).all(|landmark| filter.landmark(landmark).is_none()));
    // The biases can be forgotten, too.
    filter.begin_biases(&BIASES);
    assert_eq!((filter.bias().scale, filter.bias().steering, filter.laser_yaw()), (0.0, 0.0, 0.0));
    for (place, deviation) in [(3, BIASES.scale), (4, BIASES.steering), (5, BIASES.laser_yaw)] {
        expected.row_mut(place).fill(0.0);
        expected.column_mut(place).fill(0.0);
        expected[(place, place)] = deviation * deviation;
    }
    assert_eq!(covariance(&filter), expected);
}

#[test]
fn what_is_freed_has_neither_variance_nor_correlation() {
    let places = [(6..9, true, 0), (9..12, true, 1), (12..14, false, 0), (14..16, false, 1), (16..18, false, 2)];
    for (states, is_pose, slot) in places {
        let mut filter = full();
        let mut expected = covariance(&filter);
        for place in states.clone() {
            assert!(expected[(place, place)] > 0.0);
            expected.row_mut(place).fill(0.0);
            expected.column_mut(place).fill(0.0);
        }
        if is_pose {
            assert!(filter.past_pose(slot).is_some());
            filter.forget_pose(slot);
            assert_eq!(filter.past_pose(slot), None);
        } else {
            assert!(filter.landmark(slot).is_some());
            filter.remove_landmark(slot);
            assert_eq!(filter.landmark(slot), None);
        }
        assert_eq!(covariance(&filter), expected, "{states:?}");
    }
    // A place that does not exist is nowhere.
    let mut filter = full();
    let before = covariance(&filter);
    filter.forget_pose(KEYS);
    filter.remember_pose(KEYS);
    filter.remove_landmark(LANDMARKS);
    filter.add_known_landmark(LANDMARKS, Point::new(1.0, 1.0), 1.0);
    filter.add_landmark(LANDMARKS, &filter.viewpoint(LaserId::FIRST, &LASER), &seen(1.0, 1.0));
    assert_eq!(covariance(&filter), before);
    assert_eq!((filter.past_pose(KEYS), filter.landmark(LANDMARKS)), (None, None));
    assert!(observe(&filter, &LASER, &seen(1.0, 1.0), Landmark::Slot(LANDMARKS)).is_none());
    let relative = RelativePose { pose: Pose::default(), covariance: Matrix3::identity() };
    assert!(filter.observe_relative_pose(KEYS, &relative, &LASER).is_none());
}

#[test]
fn landmarks_and_past_poses_are_where_they_were_put() {
    let mut filter = begun();
    let there = filter.state().pose.compose(&LASER).transform(&Point::new(4.0, 1.0));
    assert!((filter.viewpoint(LaserId::FIRST, &LASER).locate(&Point::new(4.0, 1.0)) - there).norm() < 1e-12);
    filter.add_landmark(1, &filter.viewpoint(LaserId::FIRST, &LASER), &seen(4.0, 1.0));
    assert!(filter.landmark(1).is_some_and(|place| (place - there).norm() < 1e-12));
    filter.add_known_landmark(0, Point::new(7.0, -3.0), 2e-4);
    assert_eq!(filter.landmark(0), Some(Point::new(7.0, -3.0)));
    assert_eq!(
        [(12, 12), (13, 13), (12, 13), (12, 0)].map(|(a, b)| filter.packed_covariance().get(a, b)),
        [2e-4, 2e-4, 0.0, 0.0]
    );
    filter.remember_pose(1);
    assert_eq!(filter.past_pose(1), Some(filter.state().pose));
    let expected = filter.expected_relative_pose(1, &LASER);
    assert!(expected.is_some_and(|pose| pose.x.hypot(pose.y) < 1e-12 && pose.theta.abs() < 1e-12));
}

/// `H P H' + R` with all zeros.
fn dense<const SIZE: usize>(filter: &Filter, told: &Linearisation<SIZE>) -> SMatrix<f64, SIZE, SIZE> {
    let mut jacobian = SMatrix::<f64, SIZE, STATES>::zeros();
    for (place, derivative) in
        told.by_pose.iter().enumerate().chain(told.terms.iter().map(|(place, derivative)| (*place, derivative)))
    {
        jacobian.set_column(place, derivative);
    }
    jacobian * covariance(filter) * jacobian.transpose() + told.covariance
}

#[test]
fn a_known_landmark_needs_no_place() {
    let mut filter = full();
    let landmark = Point::new(6.0, 1.0);
    let pose = filter.state().pose;
    let mounted = Pose { theta: LASER.theta + filter.laser_yaw(), ..LASER };
    let expected = pose.compose(&mounted).inverse_transform(&landmark);
    let observation = seen(expected.x + 0.01, expected.y - 0.02);
    let told = known(&filter, landmark, 3e-4, &observation);
    assert!((told.residual - Vector2::new(0.01, -0.02)).norm() < 1e-12);
    assert!((told.covariance - observation.covariance - Matrix2::identity() * 3e-4).norm() < 1e-18);
    assert!((filter.residual_covariance(&told) - dense(&filter, &told)).norm() < 1e-15);
    // It says of the pose what the same landmark with a place of its own does.
    let mut placed = filter.clone();
    placed.add_known_landmark(2, landmark, 3e-4);
    filter.remove_landmark(2);
    let by_place = observe(&placed, &LASER, &observation, Landmark::Slot(2));
    assert!(by_place.is_some_and(|told| {
        assert!((placed.residual_covariance(&told) - dense(&placed, &told)).norm() < 1e-15);
        placed.correct(&told)
    }));
    assert!(filter.correct(&told));
    assert!((filter.covariance() - placed.covariance()).norm() < 1e-12);
    let off = filter.state().pose.between(&placed.state().pose);
    assert!(off.x.hypot(off.y) < 1e-10 && off.theta.abs() < 1e-10, "{off:?}");
}

#[test]
fn what_cannot_be_corrected_by_changes_nothing() {
    let filter = full();
    let before = (filter.state(), covariance(&filter));
    let sound = known(&filter, Point::new(6.0, 1.0), 1e-4, &seen(3.0, 1.0));
    let mut nowhere = sound.clone();
    nowhere.terms[0].0 = STATES;
    let cases = [
        Linearisation { covariance: -Matrix2::identity(), ..sound.clone() },
        Linearisation { covariance: Matrix2::identity() * f64::NAN, ..sound.clone() },
        Linearisation { residual: Vector2::new(f64::NAN, 0.0), ..sound.clone() },
        Linearisation { residual: Vector2::new(0.0, f64::INFINITY), ..sound },
        nowhere,
    ];
    for case in cases {
        let mut corrected = filter.clone();
        assert!(!corrected.correct(&case), "{case:?}");
        assert_eq!((corrected.state(), covariance(&corrected)), before);
    }
}
