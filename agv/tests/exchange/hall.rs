//! The drive that is exchanged.

use agv_host_sim::recording::Recording;
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::simulate;
use agv_tests::repository;

/// A drive of that many seconds through the hall.
pub fn hall(seconds: f64) -> Recording {
    let scenario = Scenario::read(&repository("host-sim/scenarios/warehouse_hall.toml")).unwrap();
    let mut recording = simulate(&scenario).unwrap().recording;
    let end = recording.truth[0].time.offset(seconds);
    recording.events.retain(|event| event.time().is_none_or(|time| time < end));
    recording.truth.retain(|truth| truth.time < end);
    recording
}
