//! When a vehicle stands, by its own account.

use agv_controller::Standstill;
use agv_core::geometry::Pose;
use agv_core::measurement::{PoseIncrement, SpeedSample, Time};
use agv_core::odometry::{CounterRange, Tricycle, Vehicle};

fn at(seconds: f64) -> Time {
    Time::from_seconds(1.0 + seconds)
}

fn tricycle(range: CounterRange) -> Vehicle {
    Vehicle::Tricycle(Tricycle {
        wheelbase: 1.2,
        drive_scale: 1e-4,
        drive_range: range,
        steering_scale: 1e-4,
        steering_range: CounterRange::BITS_16,
        steering_offset_forward: 0.0,
        steering_offset_backward: 0.0,
    })
}

#[test]
fn a_counter_that_trembles_across_the_end_of_its_range_stands() {
    let ranges = [16, 24, 32].map(|bits| 1_u64 << bits).into_iter().chain([4096, 10_000]);
    for values in ranges {
        let Some(range) = CounterRange::new(values) else { panic!("{values}") };
        let mut standstill = Standstill::new(&tricycle(range));
        let last = (values - 1) as u32;
        (0..300_u32).for_each(|number| {
            let count = if number.is_multiple_of(2) { last } else { 0 };
            standstill.sample(at(0.01 * f64::from(number)), [count, 0, 0, 0]);
        });
        assert!(standstill.stands(at(3.0)), "{values}");
        // Four ticks are none of a wheel that stands.
        standstill.sample(at(3.01), [3, 0, 0, 0]);
        assert!(!standstill.stands(at(3.01)), "{values}");
    }
}

/// 2 mm/s and 2 mrad/s at the most, whatever the rate of the reports.
#[test]
fn a_vehicle_that_reports_its_way_stands_by_its_speed() {
    for rate in [20.0, 50.0, 100.0, 500.0, 1000.0] {
        for (speed, turn, stands) in [
            (0.0, 0.0, true),
            (0.0015, 0.0, true),
            (0.0, -0.0015, true),
            (0.015, 0.0, false),
            (0.18, 0.0, false),
            (-0.1, 0.0, false),
            (0.0, 0.18, false),
        ] {
            let mut standstill = Standstill::new(&Vehicle::Increments);
            let step = Pose { x: speed / rate, y: 0.0, theta: turn / rate };
            for number in 0..=(1.3 * rate) as u32 {
                standstill.increment(&PoseIncrement { time: at(f64::from(number) / rate), displacement: step });
            }
            assert_eq!(standstill.stands(at(1.3)), stands, "{rate} Hz, {speed} m/s, {turn} rad/s");
        }
    }
}

#[test]
fn a_vehicle_that_reports_its_speed_stands_after_a_second_and_until_it_is_silent() {
    for (speed, stands) in [(0.0, true), (0.002, true), (-0.002, true), (0.003, false)] {
        let mut standstill = Standstill::new(&Vehicle::Increments);
        (0..=120).for_each(|number| {
            standstill.speed(&SpeedSample { time: at(0.01 * f64::from(number)), speed, steering: 0.0 });
        });
        assert_eq!(standstill.stands(at(1.2)), stands, "{speed}");
        assert!(!standstill.stands(at(2.3)), "{speed}: silent");
    }
}
