//! What a controller publishes while its localiser is busy is told again from its log, to the last bit.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a panic is how a test fails")]

use std::path::Path;

use agv_core::localizer::Localizer;
use agv_host_sim::log::{self, Contents};
use agv_host_sim::recording::{Publishing, RecordedEvent, RecordedOutput, RecordedPose, Recording, StoredState};
use agv_host_sim::replay::{LoggedPredictor, Replay, compare, compare_published, replay};
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
    assert_later_beginnings(&contents, &again);
}

/// Logs that begin later, with what was known by then, replay to the same bits.
fn assert_later_beginnings(contents: &Contents, whole: &Replay) {
    let Contents { recording, publishing, .. } = contents;
    let Recording { parameters, landmarks, events, .. } = recording;
    let mut localizer: Box<Localizer> = Box::new(Localizer::new(*parameters));
    localizer.add_landmarks(landmarks).unwrap();
    let mut predictor = LoggedPredictor::new(parameters);
    let answer = |events: i64| match usize::try_from(events).unwrap().checked_sub(1) {
        Some(event) => Some((whole.poses[event], whole.predictions[event])),
        None => whole.start,
    };
    let (mut poses, mut room, mut cuts) = (publishing.poses.iter().peekable(), vec![0; 1 << 20], 0);
    let mut due = 100;
    for (number, event) in events.iter().enumerate() {
        let behind = publishing.behind.iter().find(|(event, _)| *event == number).map_or(0, |(_, behind)| *behind);
        while let Some(pose) = poses.next_if(|pose| pose.events <= number) {
            predictor.publish(pose.events as i64, pose.published.behind, answer);
        }
        predictor.hear(&event.view(), number as i64, behind, answer);
        localizer.handle(&event.view());
        let is_heard = event.is_odometry() || matches!(event, RecordedEvent::Gyro(_));
        // After about each of 293 events: in all phases of a revolution.
        if number < due || behind > 0 || !is_heard {
            continue;
        }
        due = number + 293;
        let length = localizer.save_state(&mut room).unwrap();
        let of_localizer = room[..length].to_vec();
        let length = predictor.predictor().save_state(&mut room).unwrap();
        let state = StoredState { localizer: of_localizer, predictor: room[..length].to_vec() };
        assert_later(contents, number + 1, state);
        cuts += 1;
    }
    assert!(cuts > 3, "{cuts}");
}

/// A log that begins behind so many events.
fn assert_later(contents: &Contents, first: usize, state: StoredState) {
    let Contents { recording, publishing, outputs, .. } = contents;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("later.agvlog");
    let later = Recording { events: recording.events[first..].to_vec(), state: Some(state), ..recording.clone() };
    log::write(&path, &later).unwrap();
    let read = log::read_contents(&path, |_| ()).unwrap().recording;
    assert_eq!(read, later);
    let again = replay(&read, |_| ()).unwrap();
    let outputs: Vec<_> = outputs
        .iter()
        .filter(|output| output.event >= first)
        .map(|output| RecordedOutput { event: output.event - first, ..output.clone() })
        .collect();
    let comparison = compare(&outputs, &again);
    assert!(comparison.is_equal() && comparison.compared == later.events.len(), "{first}: {comparison:?}");
    let publishing = Publishing {
        behind: publishing
            .behind
            .iter()
            .filter(|(event, _)| *event >= first)
            .map(|(event, behind)| (event - first, *behind))
            .collect(),
        poses: publishing
            .poses
            .iter()
            .filter(|pose| pose.events >= first)
            .map(|pose| RecordedPose { events: pose.events - first, ..*pose })
            .collect(),
    };
    let comparison = compare_published(&read, &publishing, &again);
    assert!(comparison.is_equal() && comparison.compared > 10, "{first}: {comparison:?}");

    // Of another version, damaged or incomplete it is refused in one line.
    let refused = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut other = read.clone();
        change(&mut other.state.as_mut().unwrap().localizer);
        replay(&other, |_| ()).unwrap_err().to_string()
    };
    let version = refused(&|state| state[0] += 1);
    assert!(version.contains("version 2, this program reads 1") && !version.contains('\n'), "{version}");
    let cut = refused(&|state| state.truncate(1000));
    assert!(cut.contains("damaged") && cut.contains("--start"), "{cut}");
}
