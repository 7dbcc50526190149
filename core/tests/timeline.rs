//! The filter's past, against a filter that keeps everything and computes it anew.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use agv_core::filter::{Cartesian, Correction, Ekf, Observation, PoseObservation, Timeline, TimelineError};
use agv_core::geometry::{Point, Pose};
use agv_core::measurement::Time;
use agv_core::odometry::{Motion, UnknownAcceleration};
use nalgebra::{Matrix2, Matrix3};

use super::falko::scene::Random;
use super::support::view::linearise;

const LASER: Pose = Pose { x: 0.9, y: 0.1, theta: 0.2 };
const STEP: u64 = 10_000;
/// No doubt beside that of the motions.
const UNKNOWN: UnknownAcceleration = UnknownAcceleration { along: 0.0, aside: 0.0, turn: 0.0 };

fn start() -> (Time, Ekf) {
    (Time::from_micros(500_000), Ekf::new(Pose::new(2.0, -1.0, 0.4), 0.05, 0.02))
}

fn time(step: u64, micros: u64) -> Time {
    Time::from_micros(500_000 + step * STEP + micros)
}

/// Motions that differ from one to the next.
fn motion(step: u64) -> Motion {
    let mut random = Random::new(step);
    Motion {
        start: time(step, 0),
        end: time(step + 1, 0),
        displacement: Pose::new(
            random.uniform(0.005, 0.02),
            random.uniform(-0.001, 0.001),
            random.uniform(-0.02, 0.02),
        ),
        covariance: Matrix3::from_diagonal(&[1e-6, 2e-7, 3e-7].into()),
        distance: random.uniform(0.005, 0.02),
    }
}

fn correction(random: &mut Random) -> Correction {
    let mut near = |size: f64| random.uniform(-size, size);
    let landmark = Point::new(near(8.0), near(8.0));
    let seen = start().1.pose.compose(&LASER).inverse_transform(&landmark) + Point::new(near(0.02), near(0.02));
    let covariance = Matrix2::new(4e-4, 1e-4, 1e-4, 2e-4);
    Correction {
        observation: Observation::Cartesian(Cartesian { position: seen, covariance }),
        mount: LASER,
        landmark,
        landmark_variance: 1e-6,
    }
}

fn apply(state: &mut Ekf, correction: &Correction) {
    let Correction { observation, mount, landmark, landmark_variance } = correction;
    let linearisation = linearise(observation, &state.pose, mount, landmark, *landmark_variance);
    assert!(linearisation.is_some_and(|linearisation| state.correct(&linearisation)));
}

/// Everything that was told, in order of time; what is given replaces the state.
#[derive(Clone, Copy)]
enum Told {
    Correction(Correction),
    State(Ekf),
}

/// The state at `until` of a filter that is told everything in order of time.
fn in_order(told: &[(Time, Told)], steps: u64, until: Time) -> Ekf {
    let mut state = start().1;
    let mut pending = told.iter().filter(|(at, _)| *at <= until).peekable();
    for step in 0..steps {
        let mut rest = motion(step);
        while let Some((at, what)) = pending.next_if(|(at, _)| *at <= rest.end) {
            let (first, second) = rest.split(*at);
            state.predict(&first);
            match what {
                Told::Correction(correction) => apply(&mut state, correction),
                Told::State(given) => state = *given,
            }
            rest = second;
        }
        if rest.end >= until {
            state.predict(&rest.split(until).0);
            return state;
        }
        state.predict(&rest);
    }
    state
}

fn assert_same(a: &Ekf, b: &Ekf) {
    let off = a.pose.between(&b.pose);
    assert!(off.x.hypot(off.y) < 1e-9 && off.theta.abs() < 1e-9, "{:?} {:?}", a.pose, b.pose);
    assert!((a.covariance() - b.covariance()).norm() < 1e-9 * b.covariance().norm(), "{a:?} {b:?}");
}

#[test]
fn the_state_at_any_time_is_that_of_what_was_told_until_then() {
    for seed in 0..20 {
        let mut random = Random::new(seed);
        let mut timeline: Timeline<160> = Timeline::new(0.1, UNKNOWN);
        let (begin, state) = start();
        timeline.begin(begin, state);
        assert_eq!((timeline.start(), timeline.now()), (begin, begin));
        for step in 0..30 {
            timeline.advance(&motion(step));
            assert_eq!((timeline.now(), timeline.last_report()), (motion(step).end, motion(step).end));
        }
        let mut told: Vec<(Time, Told)> = Vec::new();
        for _ in 0..12 {
            let at = Time::from_micros(500_001 + (random.unit() * 299_998.0) as u64);
            if random.unit() < 0.2 && told.iter().all(|(other, _)| *other < at) {
                let given = Ekf::new(Pose::new(random.unit(), random.unit(), 0.1), 0.03, 0.01);
                assert_eq!(timeline.set_state(at, given), Ok(()));
                told.push((at, Told::State(given)));
            } else {
                let correction = correction(&mut random);
                let before = in_order(&told, 30, at);
                let answer = timeline.fuse(at, |state| {
                    assert_same(state, &before);
                    correction.apply(state).then_some(correction)
                });
                assert_eq!(answer, Ok(true));
                told.push((at, Told::Correction(correction)));
            }
            told.sort_by_key(|(at, _)| *at);
            // Asked for in any order, and at the entries themselves, too.
            let asked = Time::from_micros(500_000 + (random.unit() * 300_000.0) as u64);
            for asked in [asked, at, begin, motion(17).end] {
                match timeline.state_at(asked) {
                    Ok(state) => assert_same(&state, &in_order(&told, 30, asked)),
                    Err(error) => assert_eq!(None, Some(error), "{asked:?}"),
                }
            }
        }
        assert_same(&timeline.state(), &in_order(&told, 30, motion(29).end));
        // The odometry's own pose has no steps.
        let odometry = (0..30).fold(start().1.pose, |pose, step| pose.compose(&motion(step).displacement));
        let off = timeline.odometry_pose().between(&odometry);
        assert!(off.x.hypot(off.y) < 1e-12 && off.theta.abs() < 1e-12);
    }
}

#[test]
fn a_past_that_is_too_short_forgets_the_oldest_and_nothing_else() {
    // Room for 8 entries; corrections take places of motions, and the ring is written round several times.
    let mut random = Random::new(11);
    let mut timeline: Timeline<8> = Timeline::new(0.1, UNKNOWN);
    let (begin, state) = start();
    timeline.begin(begin, state);
    let mut told: Vec<(Time, Told)> = Vec::new();
    for step in 0..60 {
        timeline.advance(&motion(step));
        for late in [2, 1, 0] {
            if step >= 3 && random.unit() < 0.4 {
                let at = time(step - late, 1 + (random.unit() * 9_998.0) as u64);
                let correction = correction(&mut random);
                // What is inserted into a full ring may itself be too old.
                if timeline.fuse(at, |state| correction.apply(state).then_some(correction)) == Ok(true) {
                    told.push((at, Told::Correction(correction)));
                    told.sort_by_key(|(at, _)| *at);
                }
            }
        }
        assert_same(&timeline.state(), &in_order(&told, step + 1, motion(step).end));
    }
    assert!(told.len() > 40, "{}", told.len());
    assert_eq!(timeline.state_at(time(40, 0)), Err(TimelineError::TooLate));
    assert_eq!(timeline.set_state(time(40, 0), state), Err(TimelineError::TooLate));
}

#[test]
fn beyond_the_newest_sample_the_last_motion_goes_on_for_a_while() {
    let mut timeline: Timeline<40> = Timeline::new(0.5, UNKNOWN);
    let (begin, state) = start();
    timeline.begin(begin, state);
    timeline.advance(&motion(0));
    let last = motion(0);
    for micros in [1, 4_000, 10_000, 500_000] {
        let mut expected = in_order(&[], 1, last.end);
        let share = micros as f64 * 1e-4;
        expected.predict(&Motion {
            start: last.end,
            end: time(1, micros),
            displacement: last.displacement.fraction(share),
            covariance: last.covariance * share,
            distance: last.distance * share,
        });
        assert!(timeline.state_at(time(1, micros)).is_ok_and(|state| {
            assert_same(&state, &expected);
            true
        }));
    }
    assert_eq!(timeline.state_at(time(1, 500_001)), Err(TimelineError::TooEarly));
    assert_eq!(timeline.set_state(time(1, 500_001), state), Err(TimelineError::TooEarly));
    // Nothing was kept of what was only asked for.
    assert_eq!(timeline.now(), last.end);
    // Two states are given ahead, and two samples are behind the second one: then the odometry has its way.
    let given = Ekf::new(Pose::new(7.0, 7.0, 0.0), 0.01, 0.01);
    for micros in [4_000, 25_000] {
        assert_eq!(timeline.set_state(time(1, micros), given), Ok(()));
        assert_eq!(timeline.now(), time(1, micros));
    }
    let assumed = last.displacement.fraction(2.5);
    let until = timeline.odometry_pose().between(&start().1.pose.compose(&last.displacement).compose(&assumed));
    assert!(until.x.hypot(until.y) < 1e-9 && until.theta.abs() < 1e-12, "{until:?}");
    for step in 1..5 {
        timeline.advance(&motion(step));
        assert_eq!(timeline.last_report(), motion(step).end);
        assert_eq!(timeline.now(), motion(step).end.max(time(1, 25_000)));
    }
    let odometry = (0..5).fold(start().1.pose, |pose, step| pose.compose(&motion(step).displacement));
    let off = timeline.odometry_pose().between(&odometry);
    assert!(off.x.hypot(off.y) < 1e-12 && off.theta.abs() < 1e-12, "{off:?}");
    let way = (1..5).fold(Pose::default(), |pose, step| pose.compose(&motion(step).displacement));
    let moved = given.pose.compose(&assumed.between(&way));
    let off = timeline.state().pose.between(&moved);
    assert!(off.x.hypot(off.y) < 1e-9 && off.theta.abs() < 1e-12, "{off:?}");
}

#[test]
fn the_motions_between_two_times_are_cut_at_both() {
    let mut timeline: Timeline<40> = Timeline::new(0.1, UNKNOWN);
    let (begin, state) = start();
    timeline.begin(begin, state);
    for step in 0..20 {
        timeline.advance(&motion(step));
    }
    for (from, to) in [(33_000, 158_000), (30_000, 50_000), (31_000, 34_000), (0, 200_000)] {
        let (from, to) = (time(0, from), time(0, to));
        let motions: Vec<_> = timeline.motions(from, to).collect();
        assert!(motions.windows(2).all(|pair| pair[0].end == pair[1].start), "{motions:?}");
        assert_eq!(motions.first().map(|first| first.start), Some(from));
        assert_eq!(motions.last().map(|last| last.end), Some(to));
        let mut pose = Pose::default();
        let (mut variance, mut distance) = (0.0, 0.0);
        for motion in &motions {
            assert!(motion.end > motion.start);
            pose = pose.compose(&motion.displacement);
            variance += motion.covariance.m11;
            distance += motion.distance;
        }
        // Each is part of one of those that were told.
        let (mut expected, mut expected_distance) = (Pose::default(), 0.0);
        for step in 0..20 {
            let part = motion(step).split(from).1.split(to).0;
            expected = expected.compose(&part.displacement);
            expected_distance += part.distance;
        }
        let off = pose.between(&expected);
        assert!(off.x.hypot(off.y) < 1e-12 && off.theta.abs() < 1e-12, "{from:?} {off:?}");
        assert!((variance - 1e-4 * to.since(from)).abs() < 1e-15, "{variance}");
        assert!((distance - expected_distance).abs() < 1e-12);
    }
}

/// One tick of a tenth of a millimetre more in the last thousandth of a second: its velocity is a tenth of a metre a second, and the
/// mean of a tenth of a second has a thousandth of a metre of it. The doubt is that of one acceleration since the last report.
#[test]
fn beyond_the_newest_sample_the_mean_velocity_goes_on_with_the_doubt_of_an_acceleration() {
    let unknown = UnknownAcceleration { along: 1.0, aside: 0.5, turn: 0.7 };
    let mut timeline: Timeline<160> = Timeline::new(0.1, unknown);
    let begin = Time::from_micros(500_000);
    timeline.begin(begin, Ekf::new(Pose::default(), 0.0, 0.0));
    let at = |millis: u64| Time::from_micros(500_000 + 1_000 * millis);
    for millis in 0..200 {
        let way = if millis == 199 { 1.3e-3 } else { 1.2e-3 };
        timeline.advance(&Motion {
            start: at(millis),
            end: at(millis + 1),
            displacement: Pose::new(way, 0.0, 0.0),
            covariance: Matrix3::zeros(),
            distance: way,
        });
    }
    let last = timeline.state();
    for ahead in [10, 50, 90] {
        let seconds = f64::from(ahead) * 1e-3;
        let Ok(state) = timeline.state_at(at(200 + u64::from(ahead as u8))) else { panic!("{ahead}") };
        let way = state.pose.x - last.pose.x;
        assert!((way - 1.2 * seconds).abs() < 2.1e-3 * seconds, "{ahead}: {way}");
        let half = 0.5 * seconds * seconds;
        for (axis, acceleration) in [(0, 1.0), (2, 0.7)] {
            let deviation = state.covariance()[(axis, axis)].sqrt();
            assert!((deviation - acceleration * half).abs() < 1e-9, "{ahead} {axis}: {deviation}");
        }
        assert!(state.covariance()[(1, 1)].sqrt() >= 0.4999 * half, "{ahead}");
    }
}

#[test]
fn a_timeline_that_begins_anew_knows_nothing_of_what_was() {
    let mut timeline: Timeline<40> = Timeline::new(0.1, UNKNOWN);
    assert!(timeline.begun().is_none() && timeline.begun_mut().is_none());
    let (begin, state) = start();
    timeline.begin(begin, state);
    timeline.advance(&motion(0));
    assert_eq!(timeline.set_state(time(1, 5_000), state), Ok(()));
    let (later, other) = (time(7, 0), Ekf::new(Pose::new(-3.0, 1.0, 2.0), 0.1, 0.1));
    timeline.begin(later, other);
    assert!(timeline.begun().is_some() && timeline.begun_mut().is_some());
    assert_eq!((timeline.start(), timeline.now(), timeline.state()), (later, later, other));
    assert_eq!((*timeline.odometry_pose(), timeline.last_report()), (other.pose, later));
    timeline.advance(&motion(7));
    let expected = other.pose.compose(&motion(7).displacement);
    let off = timeline.state().pose.between(&expected);
    assert!(off.x.hypot(off.y) < 1e-12 && off.theta.abs() < 1e-12, "{off:?}");
}

/// One metre a second, straight on.
fn straight(step: u64) -> Motion {
    Motion { displacement: Pose::new(0.01, 0.0, 0.0), distance: 0.01, ..motion(step) }
}

#[test]
fn a_pose_for_a_time_between_two_samples_goes_on_by_the_rest_of_the_motion() {
    let mut timeline: Timeline<40> = Timeline::new(0.1, UNKNOWN);
    timeline.begin(time(0, 0), start().1);
    for step in 0..10 {
        timeline.advance(&straight(step));
    }
    // 57 ms before the newest sample, which is as many millimetres and 5.7 steps' variance.
    timeline.begin(time(4, 3_000), Ekf::new(Pose::new(5.0, 7.0, 0.0), 0.0, 0.0));
    assert_eq!((timeline.start(), timeline.now()), (time(4, 3_000), time(10, 0)));
    let state = timeline.state();
    for pose in [state.pose, *timeline.odometry_pose()] {
        assert!((pose.x - 5.057).abs() < 1e-12 && (pose.y - 7.0).abs() < 1e-12 && pose.theta == 0.0, "{pose:?}");
    }
    assert!((state.covariance().m11 - 5.7e-6).abs() < 1e-15, "{}", state.covariance());
    let middle = timeline.state_at(time(4, 8_000));
    assert!(middle.is_ok_and(|state| (state.pose.x - 5.005).abs() < 1e-12), "{middle:?}");
}

#[test]
fn a_time_is_reached_from_the_beginning_to_as_far_ahead_as_is_extrapolated() {
    let mut timeline: Timeline<40> = Timeline::new(0.5, UNKNOWN);
    timeline.begin(time(0, 0), start().1);
    timeline.advance(&motion(0));
    let before = Time::from_micros(time(0, 0).micros() - 1);
    assert_eq!(timeline.reaches(before), Err(TimelineError::TooLate));
    for within in [time(0, 0), time(0, 4_000), time(1, 0), time(1, 1), time(1, 500_000)] {
        assert_eq!(timeline.reaches(within), Ok(()), "{within:?}");
    }
    assert_eq!(timeline.reaches(time(1, 500_001)), Err(TimelineError::TooEarly));
}

/// What is left of the past was only assumed: the last motion that was reported is all that tells the velocity.
#[test]
fn a_vehicle_whose_pose_is_given_behind_the_last_sample_keeps_the_velocity_of_that() {
    let mut timeline: Timeline<40> = Timeline::new(0.1, UNKNOWN);
    timeline.begin(time(0, 0), start().1);
    for step in 0..10 {
        timeline.advance(&motion(step));
    }
    timeline.assume(&Motion { start: time(10, 0), end: time(13, 0), ..motion(9) });
    timeline.begin(time(11, 0), start().1);
    assert_eq!(timeline.now(), time(13, 0));
    let recent = timeline.recent_motion();
    assert_eq!((recent.start, recent.end), (time(0, 0), time(10, 0)));
    let mean = (0..10).map(|step| motion(step).displacement.x).sum::<f64>();
    assert!((recent.displacement.x - mean).abs() < 1e-4, "{recent:?} {mean}");
}

#[test]
fn what_comes_late_counts_though_a_pose_was_told_for_a_later_time() {
    let correction = correction(&mut Random::new(11));
    let seen = PoseObservation {
        pose: Pose::new(2.1, -0.95, 0.42),
        covariance: [4e-4, 1e-4, 5e-4, 0.0, 1e-5, 1e-5],
        shared: [1e-4, 1e-4, 1e-6],
        widening: 1.5,
    };
    let (first, second) = (motion(8).end, motion(14).end);
    let mut timeline: Timeline<64> = Timeline::new(0.1, UNKNOWN);
    let (begin, mut expected) = start();
    timeline.begin(begin, expected);
    for step in 0..20 {
        timeline.advance(&motion(step));
        expected.predict(&motion(step));
        match step {
            8 => apply(&mut expected, &correction),
            14 => assert!(seen.apply(&mut expected)),
            _ => {}
        }
    }
    assert_eq!(timeline.fuse_pose(second, &seen), Ok(true));
    assert_eq!(timeline.fuse(first, |state| correction.apply(state).then_some(correction)), Ok(true));
    assert_same(&timeline.state(), &expected);
}

/// What a pose shares with others does not become smaller by seeing it often, and what was known better stays so.
#[test]
fn errors_that_poses_share_remain() {
    let seen = PoseObservation {
        pose: Pose::default(),
        covariance: [1e-4, 0.0, 1e-4, 0.0, 0.0, 1e-5],
        shared: [2.5e-5, 2.5e-5, 1e-6],
        widening: 1.0,
    };
    let mut state = Ekf::with_covariance(Pose::default(), &Matrix3::from_diagonal(&[1e-2, 1e-6, 1e-3].into()));
    for _ in 0..1000 {
        assert!(seen.apply(&mut state));
    }
    let covariance = state.covariance();
    for (found, expected) in [(covariance.m11, 2.5e-5), (covariance.m22, 1e-6), (covariance.m33, 1e-6)] {
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} instead of {expected}");
    }
}

/// A pose that is widened by a factor is corrected as one whose covariance was so much larger: by the scalar gain.
#[test]
fn a_surprise_is_taken_nearly_whole() {
    let seen = PoseObservation {
        pose: Pose::new(0.3, 0.0, 0.0),
        covariance: [1e-4, 0.0, 1e-4, 0.0, 0.0, 1e-5],
        shared: [0.0; 3],
        widening: 25.0,
    };
    let mut state = Ekf::with_covariance(Pose::default(), &Matrix3::from_diagonal(&[1e-4, 1e-4, 1e-5].into()));
    assert!((seen.normalised_square(&state).unwrap() - 0.09 / 2e-4).abs() < 1e-6);
    assert!(seen.apply(&mut state));
    assert!((state.pose.x - 0.3 * 25.0 / 26.0).abs() < 1e-12, "{:?}", state.pose);
    assert!((state.covariance().m11 - 1e-4 * 25.0 / 26.0).abs() < 1e-15, "{}", state.covariance());
}

/// A driver that repeats half of what it has told: only the other half is new.
#[test]
fn of_a_motion_that_overlaps_what_was_told_the_rest_counts() {
    let mut timeline: Timeline<40> = Timeline::new(0.1, UNKNOWN);
    timeline.begin(time(0, 0), Ekf::new(Pose::default(), 0.0, 0.0));
    timeline.advance(&straight(0));
    let late = |micros: u64| Motion { start: time(0, micros), end: time(1, micros), ..straight(0) };
    timeline.advance(&late(4_000));
    assert_eq!(timeline.now(), time(1, 4_000));
    assert!((timeline.state().pose.x - 0.014).abs() < 1e-12, "{:?}", timeline.state().pose);
    // What lies before the newest entry is told twice.
    timeline.advance(&straight(0));
    assert_eq!(timeline.now(), time(1, 4_000));
    assert!((timeline.state().pose.x - 0.014).abs() < 1e-12, "{:?}", timeline.state().pose);
}
