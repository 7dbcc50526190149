//! The true pose at any time.

use agv_core::geometry::Pose;
use agv_core::measurement::Time;
use agv_host_sim::recording::{Truth, truth_at, truth_or_stand_at};

/// A metre in a second, from (12, 5) on.
fn truth() -> [Truth; 2] {
    [0, 1].map(|second| Truth {
        time: Time::from_micros(1_000_000 + 1_000_000 * second),
        pose: Pose::new(12.0 + second as f64, 5.0, 0.0),
    })
}

/// A laser's first revolution may begin before the first true pose.
#[test]
fn the_vehicle_stands_before_and_behind_its_truth() {
    let truth = truth();
    let at = |micros| truth_or_stand_at(&truth, Time::from_micros(micros)).unwrap();
    assert_eq!(at(999_999), truth[0].pose);
    assert_eq!(at(2_000_001), truth[1].pose);
    assert!((at(1_250_000).x - 12.25).abs() < 1e-12);
    assert_eq!(truth_at(&truth, Time::from_micros(999_999)), None);
    assert_eq!(truth_or_stand_at(&[], Time::from_micros(1)), None);
}
