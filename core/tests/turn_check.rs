//! Wheels and gyro that turn alike, and that do not.

use agv_core::geometry::Pose;
use agv_core::integrity::{LastingErrors, TurnCheck};
use agv_core::measurement::Time;
use agv_core::odometry::Motion;

const LASTING: LastingErrors = LastingErrors { steering: 5.8e-4, turn: 4.2e-3, bias: 4e-5 };
const PERIOD: f64 = 0.01;

/// A motion in the period of that number, m and rad, with the variance of its turn.
fn motion(number: u32, way: f64, turn: f64, variance: f64) -> Motion {
    let at = |number: u32| Time::from_micros(1_000_000 + 10_000 * u64::from(number));
    let mut motion = Motion { start: at(number), ..Motion::none(at(number + 1)) };
    (motion.displacement, motion.distance) = (Pose::new(way, 0.0, turn), way);
    motion.covariance.m33 = variance;
    motion
}

/// A vehicle creeps through a bend of 1.9 m: its counter of a quarter of a millimetre tells nothing, or a tick at once, while the gyro
/// turns evenly.
#[test]
fn a_tick_that_has_not_come_yet_is_no_slip() {
    let mut check = TurnCheck::new();
    let (mut speed, mut way, mut told) = (0.0, 0.0, 0.0);
    for number in 0..200 {
        speed = f64::min(speed + 0.3 * PERIOD, 0.016);
        way += speed * PERIOD;
        let tick = 2.5e-4;
        let counted = (way / tick).floor() * tick - told;
        told += counted;
        let wheels = motion(number, counted, counted / 1.9, 2.25e-6 * counted);
        let gyro = motion(number, counted, speed * PERIOD / 1.9, 7.6e-11);
        check.travel(&wheels, &gyro, speed / 1.9, &LASTING);
        assert!(!check.slips(wheels.end), "told after {:.0} ms", 10.0 * f64::from(number));
    }
}

/// A vehicle that somebody turns while its wheels stand, by a hundredth of a radian a second.
#[test]
fn a_turn_while_the_wheels_stand_is_told() {
    let mut check = TurnCheck::new();
    let told = (0..100).find(|number| {
        let (wheels, gyro) = (motion(*number, 0.0, 0.0, 0.0), motion(*number, 0.0, 1e-2 * PERIOD, 7.6e-11));
        check.travel(&wheels, &gyro, 1e-2, &LASTING);
        check.slips(wheels.end)
    });
    assert!(told.is_some_and(|number| number <= 20), "{told:?}");
}
