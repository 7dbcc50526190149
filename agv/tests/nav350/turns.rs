//! When an emulated sensor turns, with scans and without.

use agv_core::measurement::{ReflectorObservation, Time};
use agv_host_sim::recording::{RecordedEvent, Recording};
use agv_host_sim::serve::nav350::Drive;
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::{START, simulate};
use agv_wire::nav350::SensorFrame;

/// Noise of a direction, 0.06 deg at the default, becomes time: 21 us a deviation.
const BEARING_NOISE: f64 = 0.000_15;

fn hall() -> Recording {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../host-sim/scenarios/warehouse_hall.toml");
    let scenario = Scenario::parse(&std::fs::read_to_string(path).unwrap()).unwrap();
    simulate(&scenario).unwrap().recording
}

fn without_scans(mut recording: Recording) -> Recording {
    recording.events.retain(|event| !matches!(event, RecordedEvent::Scan(_)));
    recording
}

#[test]
fn a_turn_begins_with_its_first_beam_whether_scans_are_recorded_or_not() {
    let recording = hall();
    let scans = Drive::new(&recording, SensorFrame::default()).unwrap();
    let reflectors = Drive::new(&without_scans(recording), SensorFrame::default()).unwrap();
    let ends = reflectors.turns().len();
    assert!(ends > 100, "{ends} turns");
    for (with, without) in scans.turns().iter().zip(reflectors.turns()) {
        let late = without.start.since(with.start);
        assert!(late.abs() < BEARING_NOISE, "{late} s at {:?}", with.start);
        assert_eq!(with.reflectors, without.reflectors);
    }
}

#[test]
fn the_sensor_turns_where_there_is_nothing_to_see() {
    let frame = SensorFrame::default();
    let mut recording = without_scans(hall());
    // Seen in the third turn and in the sixth, by a reflector half-way round.
    let half = |turn: f64| ReflectorObservation {
        time: START.offset((turn + 0.5) * frame.period),
        range: 5.0,
        bearing: frame.bearing(core::f64::consts::PI) as f32,
    };
    recording.events.retain(|event| !matches!(event, RecordedEvent::Reflectors(_)));
    recording.events.extend([2.0, 5.0].map(|turn| RecordedEvent::Reflectors(vec![half(turn)].into())));
    let drive = Drive::new(&recording, frame).unwrap();
    let starts: Vec<Time> = drive.turns().iter().map(|turn| turn.start).collect();
    let expected: Vec<Time> = (0..6).map(|turn| START.offset(f64::from(turn) * frame.period)).collect();
    assert_eq!(starts, expected);
    let seen: Vec<usize> = drive.turns().iter().map(|turn| turn.reflectors.len()).collect();
    assert_eq!(seen, [0, 0, 1, 0, 0, 1]);
}
