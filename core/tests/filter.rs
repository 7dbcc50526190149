//! The filter: Jacobians, closed forms, late measurements and consistency.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is how a test fails")]

use agv_core::filter::{Cartesian, Correction, Ekf, Observation, RangeBearing, Timeline, TimelineError};
use agv_core::geometry::{Point, Pose, difference};
use agv_core::measurement::Time;
use agv_core::odometry::{Motion, UnknownAcceleration};
use nalgebra::{Matrix2, Matrix3, SMatrix, Vector3};
use proptest::prelude::*;

use super::support::view::{by_pose, linearise};

fn range_bearing(range: f64, bearing: f64) -> Observation {
    Observation::RangeBearing(RangeBearing { range, bearing, range_variance: 1e-4, bearing_variance: 1e-6 })
}

fn cartesian(position: Point) -> Observation {
    Observation::Cartesian(Cartesian { position, covariance: Matrix2::new(4e-4, 1e-4, 1e-4, 2e-4) })
}

/// What a perfect sensor at `laser` sees of `landmark`.
fn perfect(kind: usize, pose: &Pose, laser: &Pose, landmark: &Point) -> Observation {
    let seen = pose.compose(laser).inverse_transform(landmark);
    if kind == 0 { range_bearing(seen.norm(), seen.y.atan2(seen.x)) } else { cartesian(seen) }
}

proptest! {
    #[test]
    fn observation_jacobians_are_finite_differences(
        x in -20.0f64..20.0, y in -20.0f64..20.0, theta in -3.1f64..3.1,
        laser_x in -2.0f64..2.0, laser_y in -1.0f64..1.0, laser_theta in -3.1f64..3.1,
        direction in -3.1f64..3.1, distance in 1.0f64..30.0,
        kind in 0usize..2,
    ) {
        let pose = Pose::new(x, y, theta);
        let laser = Pose::new(laser_x, laser_y, laser_theta);
        let landmark = pose.compose(&laser).position() + Point::new(direction.cos(), direction.sin()) * distance;
        let observation = perfect(kind, &pose, &laser, &landmark);
        let here = linearise(&observation, &pose, &laser, &landmark, 0.0).unwrap();
        prop_assert!(here.residual.norm() < 1e-9);
        let step = 1e-6;
        for column in 0..3 {
            let moved = |by: f64| {
                let mut values = [pose.x, pose.y, pose.theta];
                values[column] += by;
                let moved = Pose::new(values[0], values[1], values[2]);
                linearise(&observation, &moved, &laser, &landmark, 0.0).unwrap().residual
            };
            // The residual is observation minus expectation.
            let (above, below) = (moved(step), moved(-step));
            let second = if kind == 0 { difference(above.y, below.y) } else { above.y - below.y };
            let slope = [-(above.x - below.x) / (2.0 * step), -second / (2.0 * step)];
            for (row, slope) in slope.into_iter().enumerate() {
                prop_assert!((by_pose(&here)[(row, column)] - slope).abs() < 1e-6 * (1.0 + slope.abs()));
            }
        }
        let back = observation.locate(&pose, &laser);
        prop_assert!((back - landmark).norm() < 1e-9);
    }

    #[test]
    fn uncertainty_of_the_landmark_widens_as_geometry_says(
        direction in -3.1f64..3.1, distance in 1.0f64..30.0, deviation in 0.0f64..0.1,
    ) {
        // The same landmark and the same doubt, once in polar and once in Cartesian coordinates.
        let landmark = Point::new(direction.cos(), direction.sin()) * distance;
        let polar = perfect(0, &Pose::default(), &Pose::default(), &landmark);
        let exact = linearise(&polar, &Pose::default(), &Pose::default(), &landmark, 0.0).unwrap();
        let doubtful = linearise(&polar, &Pose::default(), &Pose::default(), &landmark, deviation * deviation).unwrap();
        let added = doubtful.covariance - exact.covariance;
        prop_assert!((added.m11 - deviation.powi(2)).abs() < 1e-12);
        prop_assert!((added.m22 - (deviation / distance).powi(2)).abs() < 1e-12);
    }

    #[test]
    fn a_correction_keeps_the_covariance_symmetric_and_positive(
        deviation in 1e-4f64..1.0, heading_deviation in 1e-4f64..0.5,
        direction in -3.1f64..3.1, distance in 0.5f64..60.0, kind in 0usize..2,
    ) {
        let mut state = Ekf::new(Pose::default(), deviation, heading_deviation);
        let landmark = Point::new(direction.cos(), direction.sin()) * distance;
        let observation = perfect(kind, &Pose::new(0.01, -0.02, 0.003), &Pose::default(), &landmark);
        let before = state.covariance().determinant();
        let linearisation = linearise(&observation, &state.pose, &Pose::default(), &landmark, 0.0).unwrap();
        prop_assert!(state.correct(&linearisation));
        prop_assert_eq!(state.covariance(), state.covariance().transpose());
        prop_assert!(state.covariance().symmetric_eigenvalues().min() > 0.0);
        prop_assert!(state.covariance().determinant() < before);
    }
}

#[test]
fn one_correction_is_the_weighted_least_squares_solution() {
    let landmark = Point::new(3.0, 1.0);
    let prior = Ekf::new(Pose::new(0.1, -0.2, 0.05), 0.02, 0.01);
    let linearisation =
        linearise(&cartesian(Point::new(2.9, 1.05)), &prior.pose, &Pose::new(0.5, 0.0, 0.0), &landmark, 1e-4).unwrap();
    let mut state = prior;
    assert!(state.correct(&linearisation));
    // Information form, in which the gain does not occur.
    let weight = linearisation.covariance.try_inverse().unwrap();
    let prior_information = prior.covariance().try_inverse().unwrap();
    let information = prior_information + by_pose(&linearisation).transpose() * weight * by_pose(&linearisation);
    let covariance = information.try_inverse().unwrap();
    let change = covariance * by_pose(&linearisation).transpose() * weight * linearisation.residual;
    assert!((state.covariance() - covariance).norm() < 1e-12);
    let moved =
        Vector3::new(state.pose.x - prior.pose.x, state.pose.y - prior.pose.y, state.pose.theta - prior.pose.theta);
    assert!((moved - change).norm() < 1e-12);
}

const STEP: u64 = 10_000;

fn motion(step: u64) -> Motion {
    Motion {
        start: Time::from_micros(step * STEP),
        end: Time::from_micros((step + 1) * STEP),
        displacement: Pose::new(0.01, 0.0002, 0.004),
        covariance: Matrix3::from_diagonal(&Vector3::new(1e-6, 1e-7, 1e-7)),
        distance: 0.01,
    }
}

fn past() -> Timeline<160> {
    let mut timeline = Timeline::new(0.1, UnknownAcceleration { along: 0.0, aside: 0.0, turn: 0.0 });
    assert!(timeline.begun().is_none());
    timeline.begin(Time::default(), Ekf::new(Pose::default(), 0.05, 0.02));
    timeline
}

fn laser() -> Pose {
    Pose::new(0.9, 0.1, 0.02)
}

/// Observations of three landmarks at odd times within the first 0.3 s, from slightly beside the true path.
fn observations() -> Vec<(Time, Correction)> {
    let landmarks = [Point::new(6.0, 2.0), Point::new(3.0, -4.0), Point::new(-5.0, 3.0)];
    (0..12u64)
        .map(|index| {
            let time = Time::from_micros(index * 23_417 + 1_234);
            let landmark = landmarks[(index % 3) as usize];
            let way = time.seconds() / 0.01;
            let pose = Pose::new(0.01 * way + 0.01, 0.003, 0.004 * way);
            let observation = perfect((index % 2) as usize, &pose, &laser(), &landmark);
            (time, Correction { observation, mount: laser(), landmark, landmark_variance: 1e-6 })
        })
        .collect()
}

fn assert_close(a: &Ekf, b: &Ekf, tolerance: f64) {
    let difference = (a.pose.x - b.pose.x).abs() + (a.pose.y - b.pose.y).abs() + (a.pose.theta - b.pose.theta).abs();
    assert!(difference < tolerance, "{:?} and {:?}", a.pose, b.pose);
    assert!((a.covariance() - b.covariance()).norm() < tolerance * a.covariance().norm());
}

/// The same filter without a past: every motion is cut at the observations beforehand.
fn in_order(observations: &[(Time, Correction)], steps: u64) -> Ekf {
    let mut state = Ekf::new(Pose::default(), 0.05, 0.02);
    let mut pending = observations.iter().peekable();
    for step in 0..steps {
        let mut rest = motion(step);
        while let Some((time, correction)) = pending.next_if(|(time, _)| *time <= rest.end) {
            let (first, second) = rest.split(*time);
            state.predict(&first);
            let linearisation =
                linearise(&correction.observation, &state.pose, &laser(), &correction.landmark, 1e-6).unwrap();
            assert!(state.correct(&linearisation));
            rest = second;
        }
        state.predict(&rest);
    }
    state
}

#[test]
fn late_measurements_give_what_timely_ones_would_have_given() {
    let seen = observations();
    let expected = in_order(&seen, 30);
    // Forward, backward, and shuffled by a fixed stride.
    let orders: [Vec<usize>; 3] =
        [(0..12).collect(), (0..12).rev().collect(), (0..12).map(|index| index * 5 % 12).collect()];
    for order in orders {
        let mut timeline = past();
        for step in 0..30 {
            timeline.advance(&motion(step));
        }
        for index in order {
            let (time, correction) = seen[index];
            assert_eq!(timeline.fuse(time, |state| correction.apply(state).then_some(correction)), Ok(true));
        }
        assert_close(&timeline.state(), &expected, 1e-9);
    }
}

#[test]
fn at_a_thousand_motions_a_second_the_past_is_as_long_and_the_order_of_measurements_hardly_counts() {
    // Speeding up by 1 m/s^2, in a bend.
    let motion = |step: u64| {
        let way = (0.5 + step as f64 * 1e-3) * 1e-3;
        Motion {
            start: Time::from_micros(step * 1_000),
            end: Time::from_micros((step + 1) * 1_000),
            displacement: Pose::new(way, 0.0, 0.3 * way),
            covariance: Matrix3::from_diagonal(&Vector3::new(1e-7, 1e-8, 1e-8)),
            distance: way,
        }
    };
    let seen = observations();
    let mut timely = past();
    let mut late = past();
    let mut pending = seen.iter().peekable();
    for step in 0..400 {
        late.advance(&motion(step));
        timely.advance(&motion(step));
        while let Some((time, correction)) = pending.next_if(|(time, _)| *time <= motion(step).end) {
            assert_eq!(timely.fuse(*time, |state| correction.apply(state).then_some(*correction)), Ok(true));
        }
    }
    for (time, correction) in seen.iter().rev() {
        assert_eq!(
            late.fuse(*time, |state| correction.apply(state).then_some(*correction)),
            Ok(true),
            "{time:?} is remembered"
        );
    }
    assert!(pending.next().is_none());
    let (timely, late) = (timely.state().pose, late.state().pose);
    let off = (timely.position() - late.position()).norm();
    assert!(off < 5e-5 && difference(timely.theta, late.theta).abs() < 1e-5, "{off} m");
}

#[test]
fn measurements_ahead_of_the_odometry_are_extrapolated_and_set_right() {
    let seen = observations();
    let mut timeline = past();
    let mut pending = seen.iter().peekable();
    // Every observation arrives before the odometry that covers it.
    timeline.advance(&motion(0));
    for step in 1..30 {
        while let Some((time, correction)) = pending.next_if(|(time, _)| *time <= motion(step).end) {
            assert_eq!(timeline.fuse(*time, |state| correction.apply(state).then_some(*correction)), Ok(true));
        }
        timeline.advance(&motion(step));
    }
    // The motion is uniform, so extrapolation is right and the result the same.
    assert_close(&timeline.state(), &in_order(&seen, 30), 1e-6);
    assert_eq!(timeline.now(), motion(29).end);
}

#[test]
fn the_total_displacement_survives_a_wrong_extrapolation() {
    let mut timeline = past();
    timeline.advance(&motion(0));
    // A correction that says nothing, 7 ms ahead; then the vehicle turns out to have stopped.
    let (_, mut correction) = observations()[1];
    if let Observation::Cartesian(seen) = &mut correction.observation {
        seen.covariance = Matrix2::identity() * 1e12;
    }
    assert_eq!(
        timeline.fuse(Time::from_micros(17_000), |state| correction.apply(state).then_some(correction)),
        Ok(true)
    );
    let stop = Motion { displacement: Pose::new(0.001, 0.0, 0.0), ..motion(1) };
    timeline.advance(&stop);
    let expected = motion(0).displacement.compose(&stop.displacement);
    let reached = timeline.state().pose;
    assert!((reached.x - expected.x).abs() < 1e-9 && (reached.y - expected.y).abs() < 1e-9);
}

#[test]
fn what_is_too_old_or_too_new_is_refused() {
    let mut timeline = past();
    for step in 0..400 {
        timeline.advance(&motion(step));
    }
    let (_, correction) = observations()[0];
    assert_eq!(
        timeline.fuse(Time::from_micros(1_000), |state| correction.apply(state).then_some(correction)),
        Err(TimelineError::TooLate)
    );
    let ahead = motion(399).end.offset(0.2);
    assert_eq!(
        timeline.fuse(ahead, |state| correction.apply(state).then_some(correction)),
        Err(TimelineError::TooEarly)
    );
    let before = timeline.state();
    assert_eq!(timeline.fuse(motion(399).end, |_| None), Ok(false));
    assert_eq!(timeline.state(), before);
}

#[test]
fn the_relative_path_is_the_odometry_between_two_times() {
    let mut timeline = past();
    for step in 0..30 {
        timeline.advance(&motion(step));
    }
    let (from, to) = (Time::from_micros(33_000), Time::from_micros(158_000));
    let path: Vec<_> = timeline.relative_path(from, to).collect();
    assert_eq!(path.first().map(|node| node.0), Some(from));
    assert_eq!(path.last().map(|node| node.0), Some(to));
    assert!(path.windows(2).all(|pair| pair[0].0 < pair[1].0));
    let displacement = path.last().unwrap().1;
    let expected = motion(0).displacement.fraction(0.7);
    let expected = (4..15).fold(expected, |pose, step| pose.compose(&motion(step).displacement));
    let expected = expected.compose(&motion(15).displacement.fraction(0.8));
    assert!((displacement.x - expected.x).abs() < 1e-12 && (displacement.y - expected.y).abs() < 1e-12);
    // Beyond the newest entry the last velocity goes on.
    let beyond: Vec<_> = timeline.relative_path(Time::from_micros(295_000), Time::from_micros(310_000)).collect();
    let expected = motion(29).displacement.fraction(0.5).compose(&motion(29).displacement);
    assert!((beyond.last().unwrap().1.x - expected.x).abs() < 1e-12);
}

/// Normalised error squared of the filter's end in 50 runs whose noise is exactly what the filter believes.
#[test]
fn the_filter_is_consistent() {
    let landmarks: Vec<Point> =
        (0..8).map(|index| f64::from(index) * 0.785).map(|a| Point::new(8.0 * a.cos(), 8.0 * a.sin())).collect();
    let mut sum = 0.0;
    let runs = 50;
    for run in 0..runs {
        let mut random = Normal(0x9E37_79B9_7F4A_7C15u64.wrapping_mul(run + 1));
        let start = Pose::new(0.05 * random.next(), 0.05 * random.next(), 0.02 * random.next());
        let mut truth = start;
        let mut timeline = past();
        for step in 0..200 {
            let believed = motion(step);
            timeline.advance(&believed);
            let noise = believed.covariance.map_diagonal(f64::sqrt);
            truth = truth.compose(&Pose::new(
                believed.displacement.x + noise.x * random.next(),
                believed.displacement.y + noise.y * random.next(),
                believed.displacement.theta + noise.z * random.next(),
            ));
            if step % 12 == 11 {
                let landmark = landmarks[(step / 12) as usize % landmarks.len()];
                let seen = truth.compose(&laser()).inverse_transform(&landmark);
                let observation =
                    range_bearing(seen.norm() + 1e-2 * random.next(), seen.y.atan2(seen.x) + 1e-3 * random.next());
                let correction = Correction { observation, mount: laser(), landmark, landmark_variance: 0.0 };
                assert_eq!(
                    timeline.fuse(believed.end, |state| correction.apply(state).then_some(correction)),
                    Ok(true)
                );
            }
        }
        let state = timeline.state();
        let error =
            Vector3::new(truth.x - state.pose.x, truth.y - state.pose.y, difference(truth.theta, state.pose.theta));
        sum += (error.transpose() * state.covariance().try_inverse().unwrap() * error).x;
    }
    // Chi-square with 150 degrees of freedom: 99 per cent lie between these.
    assert!((109.1..198.4).contains(&sum), "sum of normalised errors squared {sum:.1}");
}

struct Normal(u64);

impl Normal {
    fn next(&mut self) -> f64 {
        let mut uniform = || {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

#[test]
fn prediction_is_the_first_order_transport_of_the_covariance() {
    let mut state = Ekf::new(Pose::new(1.0, 2.0, 0.7), 0.05, 0.02);
    let prior = state.covariance();
    state.predict(&motion(0));
    let displacement = motion(0).displacement;
    let start = Pose::new(1.0, 2.0, 0.7);
    let by_pose = start.compose_jacobian_first(&displacement);
    let by_motion = start.compose_jacobian_second();
    let stacked = SMatrix::<f64, 3, 6>::from_columns(&[
        by_pose.column(0).into_owned(),
        by_pose.column(1).into_owned(),
        by_pose.column(2).into_owned(),
        by_motion.column(0).into_owned(),
        by_motion.column(1).into_owned(),
        by_motion.column(2).into_owned(),
    ]);
    let mut joint = SMatrix::<f64, 6, 6>::zeros();
    joint.fixed_view_mut::<3, 3>(0, 0).copy_from(&prior);
    joint.fixed_view_mut::<3, 3>(3, 3).copy_from(&motion(0).covariance);
    assert!((state.covariance() - stacked * joint * stacked.transpose()).norm() < 1e-15);
}

/// Least eigenvalue of the correlations.
fn least_eigenvalue([xx, xy, yy, xh, yh, hh]: [f64; 6]) -> f64 {
    let scale = |variance: f64| if variance > 0.0 { 1.0 / variance.sqrt() } else { 0.0 };
    let scale = Matrix3::from_diagonal(&Vector3::new(xx, yy, hh).map(scale));
    (scale * Matrix3::new(xx, xy, xh, xy, yy, yh, xh, yh, hh) * scale).symmetric_eigenvalues().min()
}

fn with_entries([xx, xy, yy, xh, yh, hh]: [f64; 6]) -> Ekf {
    Ekf::with_covariance(Pose::new(1.0, 2.0, 0.5), &Matrix3::new(xx, xy, xh, xy, yy, yh, xh, yh, hh))
}

/// What very sure observations have left of very unsure states: less than rounding did.
#[test]
fn what_rounding_has_broken_is_no_covariance_that_is_said() {
    let broken = [
        [-6.8e-4, 9.8e-4, -5.0e-4, 6.0e-6, -5.1e-6, 2.5e-5],
        [-5.2e-8, -2.8e-8, 1.63e-7, 1.56e-8, 4.5e-9, 1.1e-9],
        [9.359638697910363e-8, 1.6e-7, 2.55e-7, 2.4e-9, 3.97e-9, 2.486e-9],
        [1.0, -1.0, 1.0, -1.0, -1.0, 1.0],
        [1e40, 2e40, 1e40, 0.0, 0.0, -1e-300],
    ];
    for entries in broken {
        let said = with_entries(entries).covariance_entries();
        let [xx, _, yy, _, _, hh] = said;
        assert!(xx >= 0.0 && yy >= 0.0 && hh >= 0.0, "{entries:?} {said:?}");
        assert!(least_eigenvalue(said) > -1e-4, "{entries:?} {said:?}");
        // No variance becomes smaller than what rounding has shown of it.
        let [a, _, b, _, _, c] = entries;
        assert_eq!([xx, yy, hh], [a.abs(), b.abs(), c.abs()]);
    }
}

proptest! {
    #[test]
    fn sound_covariances_are_said_as_they_are(factor in proptest::array::uniform9(-1.0f64..1.0), size in -6.0f64..6.0) {
        let factor = Matrix3::from_row_slice(&factor) * 10f64.powf(size);
        let c = factor * factor.transpose();
        let entries = [c.m11, c.m12, c.m22, c.m13, c.m23, c.m33];
        prop_assert_eq!(with_entries(entries).covariance_entries(), entries);
    }
}

#[test]
fn states_are_equal_if_pose_and_covariance_are() {
    let state = |x: f64, variance: f64| Ekf::with_covariance(Pose::new(x, 1.0, 0.2), &(Matrix3::identity() * variance));
    assert_eq!(state(0.5, 1e-4), state(0.5, 1e-4));
    assert_ne!(state(0.5, 1e-4), state(0.5, 2e-4));
    assert_ne!(state(0.5, 1e-4), state(0.6, 1e-4));
}

#[test]
fn what_is_known_of_nothing_corrects_nothing() {
    let pose = Pose::new(1.0, 2.0, 0.3);
    let mut state = Ekf::with_covariance(pose, &(Matrix3::identity() * 1e-4));
    let before = state;
    let seen =
        linearise(&cartesian(Point::new(3.0, 1.0)), &pose, &Pose::default(), &Point::new(4.0, 3.0), f64::INFINITY);
    assert!(!seen.is_some_and(|linearisation| state.correct(&linearisation)));
    assert_eq!(state, before);
}
