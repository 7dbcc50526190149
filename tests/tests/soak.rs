//! Hours of driving, in a process of its own, whose memory is theirs alone.

use agv_lab::campaign::Campaign;
use agv_lab::campaign::soak::soak;

#[test]
fn hours_leave_no_trace() {
    let path = agv_tests::repository("host-sim/scenarios/faults.toml");
    let (_, scenario) = Campaign::read(&path).unwrap();
    let hours = soak(&scenario, 2, || ()).unwrap();
    assert_eq!(hours.len(), 2);
    for hour in &hours {
        // Until the first revolutions the level is that of the pose that was given.
        assert!(hour.violations == 0 && hour.degraded_s < 0.5, "{hour:?}");
        assert!(hour.position_mm.p95 < 8.0 && hour.position_mm.max < 20.0, "{hour:?}");
    }
    // The laser's counter of milliseconds has wrapped between them.
    let [first, second] = &hours[..] else { unreachable!() };
    assert!((0.8..1.25).contains(&(second.position_mm.p95 / first.position_mm.p95)));
    if let (Some(before), Some(after)) = (first.memory_mb, second.memory_mb) {
        assert!(after < before + 5.0, "{before} MB, then {after} MB");
    }
}
