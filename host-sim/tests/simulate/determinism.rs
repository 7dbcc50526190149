use agv_core::measurement::Time;
use agv_host_sim::recording::RecordedEvent;
use agv_host_sim::simulate::block_storage::{BlockStorage, BlockStoragePath, ReflectorPlacement};
use agv_host_sim::simulate::scenario::{Scenario, WorldOptions};
use agv_host_sim::simulate::simulate;

use super::support::{encoder_samples, revolutions, scans};

#[test]
fn events_come_in_the_order_of_arrival() {
    let scenario = Scenario::block_storage_with_reflectors(BlockStoragePath::P4, ReflectorPlacement::Aisle, 5);
    let recording = simulate(&scenario).unwrap().recording;
    let mut now = Time::default();
    for event in &recording.events {
        let arrival = match event {
            RecordedEvent::Encoders(sample) => sample.time,
            RecordedEvent::Scan(scan) => scan.start.offset(0.125 + 0.010),
            RecordedEvent::Reflectors(seen) => {
                let observations = &seen.observations;
                assert!(observations.iter().all(|observation| observation.time <= now));
                assert!(observations.windows(2).all(|pair| pair[0].time <= pair[1].time));
                continue;
            }
            RecordedEvent::SetPose(fix) => fix.time,
            _ => panic!("unexpected {event:?}"),
        };
        assert!(arrival >= now);
        now = arrival;
    }
    assert!(scans(&recording).count() > 50);
    assert_eq!(scans(&recording).count(), revolutions(&recording).count());
    assert!(recording.truth.windows(2).all(|pair| pair[0].time < pair[1].time));
}

#[test]
fn a_seed_fixes_everything() {
    let scenario = Scenario::read("scenarios/people.toml".as_ref()).unwrap();
    let first = simulate(&scenario).unwrap();
    let same = scenario.clone();
    let second = std::thread::spawn(move || simulate(&same).unwrap()).join().unwrap();
    assert!(first == second);
    let other = simulate(&Scenario { seed: scenario.seed + 1, ..scenario }).unwrap();
    assert!(first.world != other.world);
    assert!(first.recording.events != other.recording.events);
}

#[test]
fn one_purpose_does_not_shift_the_numbers_of_another() {
    let plain = simulate(&Scenario::block_storage(BlockStoragePath::P4, 9)).unwrap();
    let mut scenario = Scenario::block_storage_with_reflectors(BlockStoragePath::P4, ReflectorPlacement::Aisle, 9);
    scenario.laser.range_noise = 0.02;
    scenario.laser.lost_share = 0.1;
    let rich = simulate(&scenario).unwrap();
    assert_eq!(plain.world.segments, rich.world.segments);
    assert_eq!(plain.recording.truth, rich.recording.truth);
    assert_eq!(encoder_samples(&plain.recording), encoder_samples(&rich.recording));
    assert_eq!(plain.recording.events[0], rich.recording.events[0]);
}

#[test]
fn another_run_in_the_same_world_has_other_noise() {
    let run = |seed| {
        let world = WorldOptions::BlockStorage(BlockStorage { seed: Some(4), ..BlockStorage::default() });
        simulate(&Scenario { world, ..Scenario::block_storage(BlockStoragePath::P4, seed) }).unwrap()
    };
    let (first, second) = (run(1), run(2));
    assert_eq!(first.world, second.world);
    assert!(first.recording.truth != second.recording.truth);
    assert!(scans(&first.recording).next() != scans(&second.recording).next());
}

#[test]
fn a_simulated_drive_survives_the_log() {
    let scenario = Scenario::block_storage_with_reflectors(BlockStoragePath::P4, ReflectorPlacement::Aisle, 6);
    let recording = simulate(&scenario).unwrap().recording;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drive");
    agv_host_sim::log::write(&path, &recording).unwrap();
    let (read, damages) = agv_host_sim::log::read(&path).unwrap();
    assert!(damages.is_empty());
    assert!(read == recording);
}
