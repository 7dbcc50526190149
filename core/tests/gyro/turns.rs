//! Turns that a gyro has told, against closed forms.

use agv_core::geometry::{Pose, Twist};
use agv_core::measurement::{GyroSample, Time};
use agv_core::odometry::{GyroParameters, GyroRefusal, GyroTurns, Motion};
use nalgebra::Matrix3;

use super::random::FITTED;

#[test]
fn turns_sum_up_to_the_integral_whatever_the_times_of_the_wheels() {
    // rate = 0.4 sin(t): the integral is 0.4 (1 - cos t).
    let rate = |seconds: f64| 0.4 * seconds.sin();
    let integral = |seconds: f64| 0.4 * (1.0 - seconds.cos());
    for (late, latency) in [(0.0, 0.0), (0.023, 0.0), (-0.013, 0.0), (0.004, 0.012)] {
        let mut turns = GyroTurns::new(&GyroParameters { latency, factor: -1.0, ..FITTED });
        let (mut sum, mut last, mut wheel) = (0.0, None::<f64>, 0.0);
        for step in 0..600 {
            let seconds = 0.01 * f64::from(step);
            // The gyro hangs upside down, and what it says is heard late.
            let heard = Time::from_seconds(10.0 + seconds + latency);
            turns.sample(&GyroSample { time: heard, rate: -rate(seconds) }).unwrap();
            while wheel <= seconds + late {
                if let Some(before) = last
                    && let Some(turn) = turns.turn(Time::from_seconds(10.0 + before), Time::from_seconds(10.0 + wheel))
                {
                    sum += turn.angle;
                    let expected = integral(wheel) - integral(0.02);
                    // What the held rate lacks behind the last sample is made up for later.
                    let held = 0.5 * 0.4 * (late.max(0.0) + latency + 0.02).powi(2);
                    assert!((sum - expected).abs() < held + 1e-5, "{sum} {expected} at {wheel}, late {late}");
                    last = Some(wheel);
                } else if wheel >= 0.02 - 1e-9 {
                    last = Some(wheel);
                }
                wheel += 0.02;
            }
        }
    }
}

#[test]
fn readings_that_tell_nothing_are_refused() {
    let mut turns = GyroTurns::new(&FITTED);
    let at =
        |milliseconds: u64, rate: f64| GyroSample { time: Time::from_micros(1_000_000 + 1000 * milliseconds), rate };
    assert_eq!(turns.sample(&at(0, 0.1)), Ok((0.1, None)));
    assert_eq!(turns.sample(&at(0, 0.1)), Err(GyroRefusal::OutOfOrder));
    assert_eq!(turns.sample(&at(10, 4.36)), Err(GyroRefusal::Clipped));
    assert_eq!(turns.sample(&at(20, f64::NAN)), Err(GyroRefusal::Clipped));
    assert_eq!(turns.turn(at(0, 0.0).time, at(10, 0.0).time), None);
    assert_eq!(turns.sample(&at(30, 0.2)), Ok((0.2, None)));
    assert_eq!(turns.sample(&at(40, 0.2)), Ok((0.2, Some(0.01))));
    let turn = turns.turn(at(30, 0.0).time, at(45, 0.0).time).unwrap();
    assert!((turn.angle - 0.003).abs() < 1e-15 && (turn.duration - 0.015).abs() < 1e-12);
    assert_eq!(turns.turn(at(45, 0.0).time, at(200, 0.0).time), None, "a silent gyro tells no turn");
}

#[test]
fn a_motion_takes_another_turn_as_an_arc_of_that_turn() {
    for (turn, other) in [(0.0, 0.02), (0.03, -0.01), (-0.05, -0.04)] {
        let arc = |turn: f64| Pose::exp(&Twist { x: 0.3, y: 0.0, theta: turn });
        let time = Time::from_micros(5);
        let covariance = Matrix3::new(4e-6, 1e-6, 0.0, 1e-6, 3e-6, 0.0, 0.0, 0.0, 2e-6);
        let motion = Motion { displacement: arc(turn), covariance, ..Motion::none(time) };
        let found = motion.with_turn(other, 1e-6);
        let expected = arc(other);
        assert!((found.displacement.x - expected.x).abs() < 2e-5 && (found.displacement.y - expected.y).abs() < 2e-5);
        assert!((found.displacement.theta - other).abs() < 1e-15);
        // By finite differences of the arc.
        let by = (arc(other + 1e-6).y - arc(other - 1e-6).y) / 2e-6;
        assert!((found.covariance.m23 - by * 1e-6).abs() < 2e-9, "{} {by}", found.covariance.m23);
        assert!((found.covariance.m33 - 1e-6).abs() < 1e-18);
        let by_x = (arc(other + 1e-6).x - arc(other - 1e-6).x) / 2e-6;
        let own = motion.covariance;
        for (name, entry, expected) in [
            ("xx", found.covariance.m11, own.m11 + by_x * by_x * 1e-6),
            ("xy", found.covariance.m12, own.m12 + by_x * by * 1e-6),
            ("yy", found.covariance.m22, own.m22 + by * by * 1e-6),
            ("xh", found.covariance.m13, by_x * 1e-6),
        ] {
            assert!((entry - expected).abs() < 3e-9, "{name}: {entry} {expected}");
        }
    }
}

#[test]
fn a_turn_between_two_readings_is_a_share_of_theirs() {
    let mut turns = GyroTurns::new(&FITTED);
    let at = |milliseconds: u64| Time::from_micros(1_000_000 + 1000 * milliseconds);
    for (step, rate) in [0.1, 0.3, 0.3, -0.2].into_iter().enumerate() {
        turns.sample(&GyroSample { time: at(10 * step as u64), rate }).unwrap();
    }
    // Angles at the readings, by the trapezoidal rule: 0, 0.002, 0.005, 0.0055.
    for (from, to, angle) in [(4, 10, 0.0012), (10, 13, 0.0009), (13, 25, 0.00235), (20, 24, 0.0002), (0, 30, 0.0055)] {
        let turn = turns.turn(at(from), at(to)).unwrap();
        assert!((turn.angle - angle).abs() < 1e-15, "{from} to {to}: {} {angle}", turn.angle);
        assert!((turn.duration - 1e-3 * (to - from) as f64).abs() < 1e-12);
    }
}

/// By finite differences of the displacement itself: what the turn's variance adds is along its derivative.
#[test]
fn the_covariance_of_another_turn_is_that_of_its_derivative() {
    let covariance = Matrix3::new(4e-4, 1e-4, 0.0, 1e-4, 3e-4, 0.0, 0.0, 0.0, 2e-4);
    let displacement = Pose::new(0.3, -0.4, 0.2);
    let motion = Motion { displacement, covariance, ..Motion::none(Time::from_micros(5)) };
    for (turn, variance) in [(0.2, 1e-2), (-0.5, 2e-2), (0.9, 5e-3)] {
        let at = |turn: f64| motion.with_turn(turn, variance).displacement;
        let (less, more) = (at(turn - 1e-6), at(turn + 1e-6));
        let by = nalgebra::Vector3::new((more.x - less.x) / 2e-6, (more.y - less.y) / 2e-6, 1.0);
        let mut own = covariance;
        own.m33 = 0.0;
        let expected = own + by * by.transpose() * variance;
        let found = motion.with_turn(turn, variance).covariance;
        assert!((found - expected).norm() < 1e-9, "{found} {expected}");
    }
}
