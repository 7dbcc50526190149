//! What a controller publishes while its localiser is busy is told again from its log, to the last bit.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a panic is how a test fails")]

use std::path::Path;

use agv_host_sim::log;
use agv_host_sim::recording::RecordedEvent;
use agv_host_sim::replay::{compare, compare_published, replay};
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::simulate;
use agv_tests::busy_board::drive;

#[test]
fn what_was_published_is_published_again() {
    assert_published_again(false);
}

#[test]
fn what_was_published_with_a_gyro_is_published_again() {
    assert_published_again(true);
}

fn assert_published_again(has_gyro: bool) {
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/warehouse_hall.toml");
    let mut scenario = Scenario::read(&scenario).unwrap();
    scenario.laser.scans = false;
    scenario.gyro.fitted = has_gyro;
    let recording = simulate(&scenario).unwrap().recording;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drive.agvlog");
    drive(&recording, 10, &path);
    let contents = log::read_contents(&path, |_| ()).unwrap();
    let again = replay(&contents.recording, |_| ()).unwrap();
    assert!(compare(&contents.outputs, &again).is_equal());
    let publishing = &contents.publishing;
    let late = publishing.poses.iter().filter(|pose| pose.published.behind > 1).count();
    let samples = contents.recording.events.iter().filter(|event| matches!(event, RecordedEvent::Encoders(_))).count();
    assert!(samples > 900, "{samples} samples");
    let rates = contents.recording.events.iter().filter(|event| matches!(event, RecordedEvent::Gyro(_))).count();
    assert_eq!(rates > 900, has_gyro, "{rates} rates");
    assert_eq!(contents.recording.parameters.gyro.is_fitted, has_gyro);
    println!("{} poses were published, {late} of them while the localiser was busy", publishing.poses.len());
    assert!(publishing.poses.len() > 900 && late > 100 && publishing.behind.len() > 100);
    let comparison = compare_published(&contents.recording, publishing, &again);
    assert_eq!(comparison.first_difference, None);
    assert_eq!(comparison.compared, publishing.poses.len());

    // Each pose is compared, with what it rests on.
    let mut other = publishing.clone();
    let last = other.poses.last_mut().unwrap();
    last.published.pose.pose.x += 1e-12;
    let events = last.events;
    assert_eq!(compare_published(&contents.recording, &other, &again).first_difference, Some(events));
    let mut other = publishing.clone();
    other.behind.clear();
    assert!(!compare_published(&contents.recording, &other, &again).is_equal());
}
