//! Faults are found in time, and only faults.

use agv_core::measurement::EncoderFault;
use agv_core::measurement::Time;
use agv_core::odometry::CounterRange;
use agv_wire::can::plausibility::{PlausibilityLimits, PlausibilityMonitor};
use proptest::prelude::*;

/// Ticks of a metre: a tick is a tenth of a millimetre.
const TICKS: f64 = 10_000.0;
const RANGE: CounterRange = CounterRange::BITS_24;

/// A vehicle of at most 2 m/s that brakes with at most 2.5 m/s^2.
fn limits() -> PlausibilityLimits {
    PlausibilityLimits::every(0.010, 2.0 * TICKS, 2.5 * TICKS)
}

fn at(milliseconds: f64) -> Time {
    Time::from_seconds(1.0 + milliseconds * 1e-3)
}

/// Way at a time (s) of a drive: stands, speeds up with 0.8 m/s^2, drives, brakes with 2 m/s^2, stands. Ends at 5 s.
fn way(time: f64, top: f64) -> f64 {
    let (up, down) = (top / 0.8, top / 2.0);
    let t = time - 0.5;
    let brake = 3.5;
    if t <= 0.0 {
        0.0
    } else if t < up {
        0.4 * t * t
    } else if t < brake {
        0.4 * up * up + top * (t - up)
    } else {
        let b = (t - brake).min(down);
        0.4 * up * up + top * (brake - up) + top * b - b * b
    }
}

fn counter(metres: f64, start: f64) -> u32 {
    (start + metres * TICKS).floor().rem_euclid(RANGE.values() as f64) as u32
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    /// Any top speed and direction, any start of the counter, any usual period, frames that come up to 4 ms late.
    #[test]
    fn a_normal_drive_raises_no_alarm(
        top in 0.02..1.9f64,
        is_backward: bool,
        period in prop::sample::select(vec![5, 10, 20, 50, 100]),
        start in 0.0..16_777_216.0f64,
        delays in prop::collection::vec(0.0..4.0f64, 1000),
    ) {
        let sign = if is_backward { -1.0 } else { 1.0 };
        let limits = PlausibilityLimits::every(f64::from(period) * 1e-3, 2.0 * TICKS, 2.5 * TICKS);
        let mut monitor = PlausibilityMonitor::new(limits, RANGE, at(0.0));
        for millisecond in 0..5000 {
            let now = at(f64::from(millisecond));
            let index = (millisecond / period) as usize;
            let delay = delays[index];
            if millisecond % period == delay as i32 {
                let measured = f64::from(millisecond / period * period);
                let position = counter(sign * way(measured * 1e-3, top), start);
                prop_assert_eq!(monitor.reading(at(measured + delay), position), None);
            }
            prop_assert_eq!(monitor.check(now), None, "at {} ms", millisecond);
        }
    }

    /// The fault begins at any time of a drive at speed, and is known 50 ms later.
    #[test]
    fn every_fault_is_known_within_50_ms(
        kind in 0..4usize,
        top in 0.3..1.9f64,
        begin in 2800..3400i32,
        start in 0.0..16_777_216.0f64,
    ) {
        let mut monitor = PlausibilityMonitor::new(limits(), RANGE, at(0.0));
        let mut found = None;
        for millisecond in 0..begin + 51 {
            let now = at(f64::from(millisecond));
            let seconds = f64::from(millisecond) * 1e-3;
            let is_faulty = millisecond >= begin;
            let position = match (kind, is_faulty) {
                (0, true) => None,
                (1, true) => Some(counter(way(f64::from(begin) * 1e-3, top), start)),
                (2, true) => Some(counter(way(seconds, top), start + 3.0e6)),
                (3, true) => Some(RANGE.values() as u32 + 5),
                _ => Some(counter(way(seconds, top), start)),
            };
            if let (0, Some(position)) = (millisecond % 10, position) {
                monitor.reading(now, position);
            }
            let fault = monitor.check(now);
            if let (Some(fault), true) = (fault, found.is_none()) {
                prop_assert!(is_faulty, "{fault:?} at {millisecond} ms");
                found = Some(fault);
            }
            if kind == 0 && millisecond == begin + 50 {
                prop_assert_eq!(fault, Some(EncoderFault::Missing));
            }
        }
        let expected = [EncoderFault::Late, EncoderFault::Frozen, EncoderFault::Jumped, EncoderFault::OutOfRange];
        prop_assert_eq!(found, Some(expected[kind]));
    }
}

#[test]
fn an_encoder_that_never_spoke_is_missing() {
    let mut monitor = PlausibilityMonitor::new(limits(), RANGE, at(0.0));
    assert_eq!(monitor.check(at(25.0)), None);
    assert_eq!(monitor.check(at(26.0)), Some(EncoderFault::Late));
    assert_eq!(monitor.check(at(46.0)), Some(EncoderFault::Missing));
}

#[test]
fn a_counter_that_is_stuck_from_the_start_is_found_by_what_others_know() {
    let mut monitor = PlausibilityMonitor::new(limits(), RANGE, at(0.0));
    let mut found = None;
    for step in 0..60 {
        let milliseconds = 10.0 * f64::from(step);
        if step == 50 {
            monitor.expect_motion(-0.1 * TICKS, at(milliseconds));
        }
        monitor.reading(at(milliseconds), 77);
        if monitor.check(at(milliseconds)).is_some() {
            found = found.or(Some((step, monitor.check(at(milliseconds)))));
        }
    }
    assert_eq!(found, Some((53, Some(EncoderFault::Frozen))));
}

#[test]
fn a_known_standstill_clears_a_frozen_counter() {
    let mut monitor = PlausibilityMonitor::new(limits(), RANGE, at(0.0));
    let mut position = 0;
    for step in 0..100 {
        if step < 50 {
            position += 100;
        }
        monitor.reading(at(10.0 * f64::from(step)), position);
    }
    assert_eq!(monitor.check(at(990.0)), Some(EncoderFault::Frozen));
    monitor.expect_standstill();
    for step in 100..140 {
        monitor.reading(at(10.0 * f64::from(step)), position);
    }
    assert_eq!(monitor.check(at(1390.0)), None);
}

#[test]
fn a_fault_is_withdrawn_after_sound_readings_only() {
    let mut monitor = PlausibilityMonitor::new(limits(), RANGE, at(0.0));
    monitor.reading(at(0.0), 0);
    assert_eq!(monitor.reading(at(10.0), 100_000), Some(EncoderFault::Jumped));
    for step in 2..=21 {
        assert_eq!(monitor.reading(at(10.0 * f64::from(step)), 100_000), None);
        assert_eq!(monitor.check(at(10.0 * f64::from(step))), Some(EncoderFault::Jumped), "{step}");
    }
    monitor.reading(at(220.0), 100_000);
    assert_eq!(monitor.check(at(220.0)), None);
}

/// Readings every 10 ms of a counter at these places, m; the first fault that they show, and after how many readings.
fn first_fault(places: impl Iterator<Item = f64>) -> Option<(EncoderFault, usize)> {
    let mut monitor = PlausibilityMonitor::new(limits(), RANGE, at(0.0));
    places.enumerate().find_map(|(index, place)| {
        let fault = monitor.reading(at(10.0 * index as f64), counter(place, 5_000_000.0));
        fault.map(|fault| (fault, index))
    })
}

/// At any speed from which the vehicle could not have stopped, in either direction: the first reading that goes back shows it.
#[test]
fn a_counter_that_is_reversed_while_it_counts_has_jumped() {
    for speed in [0.2, 0.5, 1.0, 1.9, -0.4, -1.5] {
        let turned = |index: usize| 0.01 * speed * (50.0 - (index as f64 - 50.0).abs());
        assert_eq!(first_fault((0..100).map(turned)), Some((EncoderFault::Jumped, 51)), "{speed}");
    }
}

/// It stops by brakes that are harder than is stated, and rolls back by some millimetres; or turns round as brakes allow.
#[test]
fn a_vehicle_that_rolls_back_or_turns_round_has_not_jumped() {
    let stop = |index: usize| {
        let time = 0.01 * index as f64 - 0.5;
        let (speed, brakes) = (1.5, 5.0);
        let braking = time.clamp(0.0, speed / brakes);
        let back = 0.005 * ((time - speed / brakes) / 0.1).clamp(0.0, 1.0);
        speed * (time.min(0.0) + braking) - 0.5 * brakes * braking * braking - back
    };
    assert_eq!(first_fault((0..100).map(stop)), None);
    let round = |index: usize| {
        let time = 0.01 * index as f64 - 0.5;
        1.0 * time - 0.5 * 2.0 * time.max(0.0).powi(2)
    };
    assert_eq!(first_fault((0..150).map(round)), None);
}
