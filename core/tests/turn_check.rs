//! Wheels and gyro that turn alike, and that do not.

use agv_core::geometry::Pose;
use agv_core::integrity::{LastingErrors, TurnCheck};
use agv_core::measurement::Time;
use agv_core::odometry::Motion;

const LASTING: LastingErrors = LastingErrors { steering: 5.8e-4, turn: 4.2e-3, bias: 4e-5, step: 1e-4 };
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

/// Sums since the window began: the square of the difference over what is expected of it, over that of the gate of six deviations.
#[test]
fn the_ratio_is_that_of_the_sums() {
    let lasting = LastingErrors { steering: 2e-3, turn: 0.05, bias: 1e-3, step: 1e-4 };
    let mut check = TurnCheck::new();
    let (mut difference, mut variance, mut way, mut turned, mut seconds) = (0.0_f64, 0.0, 0.0, 0.0, 0.0);
    // All of it within the first half of the first window.
    for number in 0..14 {
        let sign = if number % 3 == 0 { -1.0 } else { 1.0 };
        let (wheels, gyro) = (motion(number, 0.01, 0.002, 3e-9), motion(number, 0.01, sign * 0.0015, 1e-9));
        let rate = 0.1 + 0.01 * f64::from(number);
        let ratio = check.travel(&wheels, &gyro, rate, &lasting);
        difference += 0.002 - sign * 0.0015;
        (variance, way, turned, seconds) = (variance + 4e-9, way + 0.01, turned + 0.0015, seconds + PERIOD);
        // The window began with a gyro of which nothing was known: it stood.
        let parts = [2e-3 * way, 0.05 * turned, 1e-3 * seconds, 0.01 * rate, 1e-4];
        let expected = variance + parts.iter().map(|part| part * part).sum::<f64>();
        let first = difference * difference / expected / 36.0;
        // The second window begins anew with each motion.
        let (since, last) = (0.002 - sign * 0.0015, [2e-3 * 0.01, 0.05 * 0.0015, 1e-3 * PERIOD, 1e-4]);
        let change = 0.01 * if number == 0 { rate } else { 0.01 };
        let of_last = 4e-9 + change * change + last.iter().map(|part| part * part).sum::<f64>();
        let largest = first.max(since * since / of_last / 36.0);
        assert!((ratio - largest).abs() < 1e-9 * largest, "{number}: {ratio} {largest}");
    }
}

/// A difference that grows evenly for so many samples from one on, of a vehicle that stands.
fn is_told(spans: &[(u32, u32)], rate: f64) -> bool {
    let lasting = LastingErrors { steering: 0.0, turn: 0.0, bias: 0.0, step: 1e-4 };
    let mut check = TurnCheck::new();
    (0..700).any(|number| {
        let grows = spans.iter().any(|(from, until)| (*from..*until).contains(&number));
        let turn = if grows { rate } else { 0.0 };
        let _ = check.travel(&motion(number, 0.0, turn, 0.0), &motion(number, 0.0, 0.0, 0.0), 0.0, &lasting);
        check.slips(motion(number, 0.0, 0.0, 0.0).end)
    })
}

/// Windows of three seconds begin every one and a half: what grows on both sides of the end of one is within the next.
#[test]
fn windows_overlap_by_half() {
    // Six deviations of a step of the wheels: 6e-4 rad.
    assert!(!is_told(&[(160, 290)], 3.5e-6), "4.6e-4 rad");
    assert!(!is_told(&[(305, 430)], 3.5e-6), "4.4e-4 rad");
    assert!(is_told(&[(160, 290), (305, 430)], 3.5e-6), "8.9e-4 rad");
    assert!(!is_told(&[(10, 140), (500, 630)], 3.5e-6), "in no window together");
}

#[test]
fn a_gyro_is_frozen_only_if_the_wheels_move() {
    let reading =
        |number: u32| agv_core::measurement::GyroSample { time: motion(number, 0.0, 0.0, 0.0).end, rate: 0.01 };
    for (way, has_turn, is_frozen) in [(0.01, true, true), (0.0, true, false), (0.01, false, true), (0.0, false, false)]
    {
        let mut check = TurnCheck::new();
        let found = (0..30).any(|number| {
            let moved = motion(number, way, 0.0, 1e-9);
            if has_turn {
                let _ = check.travel(&moved, &moved, 0.01, &LASTING);
            } else {
                check.travel_alone(&moved, false);
            }
            !check.sample(&reading(number))
        });
        assert_eq!(found, is_frozen, "{way} m, {has_turn}");
    }
}

/// Motions of a hundredth of a second. One that stands need not tell a turn.
#[test]
fn a_gyro_that_tells_no_turn_for_more_than_a_tenth_of_a_second_is_missing() {
    use agv_core::integrity::GyroFault;
    for (alone, stands, fault) in [(11, false, None), (12, false, Some(GyroFault::Missing)), (40, true, None)] {
        let mut check = TurnCheck::new();
        let moved = |number: u32| motion(number, 0.01, 0.0, 1e-9);
        let _ = check.travel(&moved(0), &moved(0), 0.0, &LASTING);
        (1..=alone).for_each(|number| check.travel_alone(&moved(number), stands));
        assert_eq!(check.fault(moved(alone).end), fault, "{alone}");
    }
}

/// The second window begins in the middle of the first one, be it of the way or of the time: of three motions of which the second ends
/// there, it has the last two.
#[test]
fn the_second_window_begins_in_the_middle() {
    let lasting = LastingErrors { steering: 0.0, turn: 0.0, bias: 0.0, step: 1e-4 };
    for (way, micros) in [(0.075, 10_000), (0.0, 750_000)] {
        let mut check = TurnCheck::new();
        let at = |number: u64| Time::from_micros(1_000_000 + micros * number);
        let ratios = [-1e-3, 1e-3, 1e-3].map(|turn| {
            let number = 0;
            let mut wheels = Motion { start: at(number), ..Motion::none(at(number + 1)) };
            (wheels.displacement.theta, wheels.distance) = (turn, way);
            let gyro = Motion { displacement: Pose::default(), ..wheels };
            check.travel(&wheels, &gyro, 0.0, &lasting)
        });
        let [.., last] = ratios;
        assert!((last - 4e-6 / 1e-8 / 36.0).abs() < 1e-6, "{way} m, {micros} us: {ratios:?}");
    }
}
