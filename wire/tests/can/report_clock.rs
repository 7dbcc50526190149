//! Reports that arrive late are taken for what they are.

use agv_core::measurement::Time;
use agv_wire::can::report_clock::ReportClock;
use proptest::prelude::*;

const PERIOD: f64 = 0.010;
const START: Time = Time::from_micros(1_000_000);

/// The true time of report `number` of a node whose clock is off by that share.
fn made(number: usize, drift: f64) -> Time {
    START.offset(PERIOD * (1.0 + drift) * number as f64)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    /// Delays as of a bus under load: most are small, some hold everything up for a while.
    #[test]
    fn delays_do_not_become_motion(
        delays in proptest::collection::vec(prop_oneof![39 => 0.0f64..0.0005, 1 => 0.0f64..0.020], 400),
        drift in -1e-4f64..1e-4,
    ) {
        let mut clock = ReportClock::new(PERIOD);
        let mut free = START;
        let (mut worst, mut shortest) = (0.0f64, f64::INFINITY);
        let mut last: Option<Time> = None;
        for (number, delay) in delays.iter().enumerate() {
            // Frames of one node stay in order.
            let arrival = made(number, drift).offset(*delay).max(free);
            free = arrival;
            let time = clock.time(arrival);
            prop_assert!(time <= arrival);
            if let Some(last) = last.filter(|_| number > 100) {
                worst = worst.max(time.since(made(number, drift)).abs());
                shortest = shortest.min(time.since(last));
            }
            last = Some(time);
        }
        prop_assert!(worst < 0.0035, "{worst}");
        prop_assert!(shortest > 0.5 * PERIOD, "{shortest}");
    }

    #[test]
    fn a_punctual_node_is_believed_to_the_microsecond(milliseconds in 1u8..100) {
        let period = 1e-3 * f64::from(milliseconds);
        let mut clock = ReportClock::new(period);
        for number in 0..100 {
            let arrival = START.offset(period * f64::from(number));
            prop_assert!(arrival.since(clock.time(arrival)) <= 2e-6);
        }
    }

    #[test]
    fn lost_reports_and_other_periods_are_learnt(lost in 1usize..6, other in 0.5f64..3.0) {
        let mut clock = ReportClock::new(PERIOD);
        for number in (0..50).chain(50 + lost..60 + lost) {
            let arrival = made(number, 0.0);
            let time = clock.time(arrival);
            prop_assert!(number < 57 + lost || time == arrival, "{number}");
        }
        let mut clock = ReportClock::new(PERIOD);
        for number in 0..50 {
            let arrival = START.offset(other * PERIOD * f64::from(number));
            let time = clock.time(arrival);
            prop_assert!(number < 10 || arrival.since(time) <= 1.5 * PERIOD, "{number}");
        }
    }
}
