//! The sensor's clock against lines that are known.

use agv_core::measurement::Time;
use agv_wire::nav350::{ClockError, DeviceTime, SensorClock};
use proptest::prelude::*;

/// What the sensor's clock shows at `micros` of the vehicle's.
fn device(micros: u64, offset: u64, drift: f64) -> DeviceTime {
    let elapsed = micros as f64 * 1e-3 / (1.0 + drift);
    DeviceTime((offset as f64 + elapsed).floor() as u64 as u32)
}

proptest! {
    /// Symmetric delays of any length: the answer is right up to the sensor's resolution and drift, across wraps too.
    #[test]
    fn symmetric_delays_are_exact(
        offset in prop_oneof![any::<u32>().prop_map(u64::from), (0_u64..90_000).prop_map(|before| (1 << 32) - before)],
        drift in -200e-6..200e-6_f64,
        delays in prop::collection::vec(200_u64..3000, 100),
    ) {
        let mut clock = SensorClock::new();
        let start = 1_000_000_000_u64;
        for (index, delay) in delays.iter().enumerate() {
            let sent = start + index as u64 * 1_000_000;
            let read = device(sent + delay, offset, drift);
            let received = Time::from_micros(sent + 2 * delay);
            prop_assert_eq!(clock.record(Time::from_micros(sent), received, read), Ok(()));
            // Two seconds ahead of the last exchange, and two behind.
            if index > 30 {
                for lead in [-2_000_000_i64, 0, 125_000, 2_000_000] {
                    let instant = sent.checked_add_signed(lead).unwrap();
                    let local = clock.to_local(device(instant, offset, drift)).unwrap();
                    let error = local.since(Time::from_micros(instant));
                    // The sensor rounds down twice, in the exchanges and in what is converted, and clocks whose drift
                    // is not known yet drift apart.
                    prop_assert!(error.abs() < 2.5e-3, "{} s at exchange {}", error, index);
                    let back = clock.to_device(Time::from_micros(instant)).unwrap();
                    prop_assert!(back.since(device(instant, offset, drift)).abs() <= 2);
                }
            }
        }
        prop_assert!((clock.drift() - drift).abs() < 100e-6, "{} {}", clock.drift(), drift);
    }

    /// Some answers are late on the way back only. Those with a small round trip decide.
    #[test]
    fn late_answers_do_not_shift_the_clock(late in prop::collection::vec(0_u64..400_000, 60), offset in any::<u32>()) {
        let mut clock = SensorClock::new();
        for (index, late) in late.iter().enumerate() {
            let sent = 5_000_000 + index as u64 * 1_000_000;
            let late = if index % 4 == 0 { 0 } else { *late };
            let read = device(sent + 500, offset.into(), 0.0);
            clock.record(Time::from_micros(sent), Time::from_micros(sent + 1000 + late), read).unwrap();
        }
        let instant = 66_000_000;
        let error = clock.to_local(device(instant, offset.into(), 0.0)).unwrap().since(Time::from_micros(instant));
        // Half of the round trips that still count, and the resolution.
        prop_assert!(error.abs() < 2.6e-3, "{}", error);
    }

    /// Any exchange, in any order.
    #[test]
    fn no_exchange_hurts(exchanges in prop::collection::vec(any::<(u64, u64, u32)>(), 0..80)) {
        let mut clock = SensorClock::new();
        for (sent, received, read) in exchanges {
            let _ = clock.record(Time::from_micros(sent), Time::from_micros(received), DeviceTime(read));
            let _ = clock.to_local(DeviceTime(read.wrapping_mul(7)));
            let _ = clock.to_device(Time::from_micros(sent));
        }
    }
}

#[test]
fn a_restart_is_noticed_and_learnt() {
    let mut clock = SensorClock::new();
    assert_eq!(clock.to_local(DeviceTime(5)), None);
    for second in 0..40_u64 {
        let sent = Time::from_micros(second * 1_000_000);
        let uptime = if second < 30 { 7_000_000 + second * 1000 } else { (second - 30) * 1000 };
        let outcome = clock.record(sent, sent.offset(0.001), DeviceTime(uptime as u32));
        assert_eq!(outcome, if second == 30 { Err(ClockError::Restarted) } else { Ok(()) }, "{second}");
    }
    let local = clock.to_local(DeviceTime(9500)).unwrap();
    assert!((local.seconds() - 39.5).abs() < 1e-3, "{local:?}");
}

#[test]
fn exchanges_that_are_too_slow_or_backwards_are_refused() {
    let mut clock = SensorClock::new();
    let (early, late) = (Time::from_micros(0), Time::from_micros(1_100_000));
    assert_eq!(clock.record(early, late, DeviceTime(1)), Err(ClockError::RoundTrip));
    assert_eq!(clock.record(late, early, DeviceTime(1)), Err(ClockError::RoundTrip));
    assert!(!clock.is_known());
}

/// The clocks agree, and the network holds back each packet for up to 200 ms: the answer is wrong by half of the best round
/// trip, and by what unknown clocks may have drifted since.
#[test]
fn jitter_is_not_taken_for_drift() {
    let mut state = 1_u64;
    let mut delay = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) % 200_000
    };
    for _ in 0..200 {
        let mut clock = SensorClock::new();
        let mut halves: Vec<u64> = Vec::new();
        for second in 0..120_u64 {
            let (sent, there, back) = (10_000_000 + 1_000_000 * second, delay(), delay());
            let received = Time::from_micros(sent + there + back);
            // Nor for a restart.
            assert_eq!(clock.record(Time::from_micros(sent), received, device(sent + there, 0, 0.0)), Ok(()));
            assert_eq!(clock.drift(), 0.0);
            halves.push((there + back) / 2);
            let remembered = halves.iter().rev().take(32).zip(0_u32..);
            let least = remembered.map(|(half, age)| 1e-6 * *half as f64 + 200e-6 * f64::from(age));
            let bound = least.fold(f64::INFINITY, f64::min);
            let error = clock.to_local(device(sent, 0, 0.0)).unwrap().since(Time::from_micros(sent));
            // Exchanges that are nearly as good count too, and the sensor rounds down twice.
            assert!(error.abs() < bound + 2.5e-3, "{error} {bound}");
        }
    }
}

/// From some moment on all answers are late: what was known before holds until the clocks may have drifted apart by as much.
#[test]
fn a_network_that_becomes_slow_does_not_shift_the_clock() {
    for (before, drift) in [(5_u64, 0.0), (20, 20e-6), (40, -100e-6), (200, 100e-6)] {
        let mut clock = SensorClock::new();
        for second in 0..before + 100 {
            let sent = 10_000_000 + 1_000_000 * second;
            let late = if second < before { 0 } else { 50_000 };
            let received = Time::from_micros(sent + 1000 + late);
            assert_eq!(clock.record(Time::from_micros(sent), received, device(sent + 500, 77, drift)), Ok(()));
            let error = clock.to_local(device(sent, 77, drift)).unwrap().since(Time::from_micros(sent));
            let drifted = if before > 10 { 30e-6 } else { 200e-6 } * second.saturating_sub(before) as f64;
            assert!(error.abs() < 2.5e-3 + drifted, "{before} s, {second}: {error}");
        }
    }
}
