//! Logs as files: round trip, cuts, damage, appending, and files that are no logs.

use std::path::{Path, PathBuf};

use agv_core::geometry::Pose;
use agv_core::localizer::{Parameters, PoseFix, StatedCapacities};
use agv_core::maps::{Landmark, LandmarkKind};
use agv_core::measurement::{EncoderSample, LaserId, PoseIncrement, ReflectorObservation, SpeedSample, Time};
use agv_core::odometry::Vehicle;
use agv_core::record::{Damage, DamageReason, Header, Item, Record};
use agv_host_sim::log::{self, LogError, Reader, Writer};
use agv_host_sim::recording::{RecordedEvent, RecordedScan, Recording, Reference, Truth};
use proptest::prelude::*;
use tempfile::TempDir;

fn parameters() -> Parameters {
    Parameters::new(Vehicle::Increments, Pose::new(0.9, 0.0, 0.01))
}

/// A drive with every kind of event.
fn small_recording() -> Recording {
    let at = Time::from_micros;
    let landmark = |id| Landmark { id, kind: LandmarkKind::Reflector, x: f64::from(id), y: -1.5, deviation: 0.01 };
    Recording {
        parameters: parameters(),
        landmarks: (0..51).map(landmark).collect(),
        events: vec![
            RecordedEvent::SetPose(PoseFix {
                time: at(0),
                pose: Pose::new(1.0, 2.0, 0.5),
                position_deviation: 0.005,
                heading_deviation: 0.001,
            }),
            RecordedEvent::Encoders(EncoderSample { time: at(1000), drive: 4_294_967_290, steering: 17 }),
            RecordedEvent::Speed(SpeedSample { time: at(2000), speed: 1.5, steering: -0.2 }),
            RecordedEvent::Increment(PoseIncrement { time: at(3000), displacement: Pose::new(0.1, 0.0, 0.02) }),
            RecordedEvent::Reflectors(
                vec![ReflectorObservation { time: at(2500), range: 4.0, bearing: 1.0 }; 2].into(),
            ),
            RecordedEvent::Scan(RecordedScan {
                laser: LaserId::FIRST,
                start: at(4000),
                beam_interval: 1e-5,
                first_bearing: -1.0,
                bearing_step: 0.01,
                ranges: vec![1.0, 0.0, f32::INFINITY, 2.5],
                intensities: vec![0, 7, 65535, 1],
            }),
        ],
        truth: (0..4).map(|n| Truth { time: at(n * 1500), pose: Pose::new(n as f64, 0.0, 0.1) }).collect(),
        references: vec![
            Reference { time: at(100), x: 1.0, y: 2.0, heading: None },
            Reference { time: at(90_000), x: 1.0, y: 2.0, heading: Some(0.3) },
        ],
        state: None,
    }
}

fn written(recording: &Recording) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drive.agvlog");
    log::write(&path, recording).unwrap();
    (folder, path)
}

/// Where each record begins, and the record as text.
type Listed = Vec<(u64, String)>;

/// All records and all damages of a log.
fn listed(path: &Path) -> Result<(Listed, Vec<Damage>), LogError> {
    let mut reader = Reader::open(path)?;
    let (mut records, mut damages) = (Vec::new(), Vec::new());
    while let Some(item) = reader.next()? {
        match item {
            Item::Record { offset, record, .. } => records.push((offset, format!("{record:?}"))),
            Item::Damage(damage) => damages.push(damage),
        }
    }
    Ok((records, damages))
}

#[test]
fn a_drive_is_read_as_it_was_written() {
    let recording = small_recording();
    let (_folder, path) = written(&recording);
    assert_eq!(log::read(&path).unwrap(), (recording, vec![]));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 30, failure_persistence: None, ..ProptestConfig::default() })]

    /// Many scans, so that the reader's buffer is refilled within records.
    #[test]
    fn long_drives_survive_too(lengths in prop::collection::vec(0_usize..4000, 0..200), first in -1e3_f32..1e3) {
        let mut recording = small_recording();
        recording.events.extend(lengths.iter().enumerate().map(|(index, length)| RecordedEvent::Scan(RecordedScan {
            laser: LaserId::FIRST,
            start: Time::from_micros(index as u64),
            beam_interval: 0.0,
            first_bearing: 0.0,
            bearing_step: 0.1,
            ranges: (0..*length).map(|beam| first + beam as f32).collect(),
            intensities: vec![3; length / 2],
        })));
        let (_folder, path) = written(&recording);
        prop_assert_eq!(log::read(&path).unwrap(), (recording, vec![]));
    }
}

#[test]
fn a_cut_log_has_the_truth_up_to_the_cut() {
    let (_folder, path) = written(&small_recording());
    let (records, _) = listed(&path).unwrap();
    let kinds: Vec<&str> = records.iter().map(|(_, text)| text.split(['(', ' ']).next().unwrap()).collect();
    let expected = [
        "Header",
        "Landmarks",
        "Landmarks",
        "Truth",
        "Event",
        "Reference",
        "Event",
        "Truth",
        "Event",
        "Truth",
        "Event",
        "Event",
        "Event",
        "Truth",
        "Reference",
        "End",
    ];
    assert_eq!(kinds, expected);
}

#[test]
fn a_log_cut_at_any_byte_reads_up_to_the_cut() {
    let (_folder, path) = written(&small_recording());
    let whole = std::fs::read(&path).unwrap();
    let (records, _) = listed(&path).unwrap();
    let ends: Vec<u64> = records.iter().skip(1).map(|(offset, _)| *offset).chain([whole.len() as u64]).collect();
    for cut in 1..whole.len() {
        std::fs::write(&path, &whole[..cut]).unwrap();
        let survivors = ends.iter().filter(|end| **end <= cut as u64).count();
        let (read, damages) = listed(&path).unwrap();
        assert_eq!(read, records[..survivors], "cut at {cut}");
        let last_end = survivors.checked_sub(1).map_or(0, |last| ends[last]);
        assert_eq!(damages.len(), usize::from(last_end != cut as u64), "cut at {cut}");

        match log::read(&path) {
            Ok((_, damages)) => {
                assert!(survivors > 0);
                assert_eq!(damages.len(), 1, "cut at {cut}");
                assert_eq!((damages[0].reason, damages[0].offset), (DamageReason::Cut, last_end));
            }
            Err(LogError::Header { .. }) => assert_eq!(survivors, 0),
            Err(error) => panic!("cut at {cut}: {error}"),
        }
    }
}

#[test]
fn a_damaged_byte_costs_one_record_and_is_reported() {
    let (_folder, path) = written(&small_recording());
    let whole = std::fs::read(&path).unwrap();
    let (records, _) = listed(&path).unwrap();
    for position in 0..whole.len() {
        let mut damaged = whole.clone();
        damaged[position] ^= 0xFF;
        std::fs::write(&path, &damaged).unwrap();
        let hit = records.iter().rposition(|(offset, _)| *offset <= position as u64).unwrap();
        let mut expected = records.clone();
        let (offset, _) = expected.remove(hit);
        let (read, damages) = listed(&path).unwrap();
        assert_eq!(read, expected, "byte {position}");
        assert_eq!(damages.len(), 1, "byte {position}");
        assert_eq!(damages[0].offset, offset, "byte {position}");
        match log::read(&path) {
            Ok((_, damages)) => assert!(hit > 0 && damages[0].offset == offset),
            Err(LogError::Header { damage, .. }) => assert!(hit == 0 && damage.unwrap().offset == 0),
            Err(error) => panic!("byte {position}: {error}"),
        }
    }
}

#[test]
fn megabytes_of_foreign_bytes_are_one_damage() {
    let (_folder, path) = written(&small_recording());
    let whole = std::fs::read(&path).unwrap();
    let (records, _) = listed(&path).unwrap();
    let middle = records[5].0 as usize;
    // Every fourth byte begins the magic and breaks it off.
    let foreign = [0xD6, 0x41, 0x47, 0x00].repeat(700_000);
    std::fs::write(&path, [&whole[..middle], &foreign, &whole[middle..]].concat()).unwrap();
    let (read, damages) = listed(&path).unwrap();
    assert_eq!(
        read.iter().map(|(_, text)| text).collect::<Vec<_>>(),
        records.iter().map(|(_, text)| text).collect::<Vec<_>>()
    );
    assert_eq!(damages, [Damage { offset: middle as u64, skipped: foreign.len() as u64, reason: DamageReason::Magic }]);
}

#[test]
fn appending_goes_on_behind_the_last_good_record() {
    let (_folder, path) = written(&small_recording());
    let whole = std::fs::read(&path).unwrap();
    let (records, _) = listed(&path).unwrap();
    let note = format!("{:?}", Record::Note("again"));
    for cut in [whole.len(), whole.len() - 1, whole.len() - 30, records[5].0 as usize + 3, records[1].0 as usize] {
        std::fs::write(&path, &whole[..cut]).unwrap();
        let (kept, _) = listed(&path).unwrap();
        let (mut writer, _) = Writer::append(&path).unwrap();
        writer.write(&Record::Note("again")).unwrap();
        writer.finish().unwrap();
        let (read, damages) = listed(&path).unwrap();
        assert_eq!(damages, [], "cut at {cut}");
        let texts: Vec<&String> = read.iter().map(|(_, text)| text).collect();
        let end = "End".to_owned();
        let kept = kept.iter().map(|(_, text)| text).filter(|text| **text != end);
        assert_eq!(texts, kept.chain([&note, &end]).collect::<Vec<_>>(), "cut at {cut}");
    }
}

#[test]
fn a_log_states_what_its_localiser_had_room_for() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drive.agvlog");
    Writer::begin(&path, &parameters(), &[]).unwrap().finish().unwrap();
    let mut reader = Reader::open(&path).unwrap();
    let Some(Item::Record { record: Record::Header(header), .. }) = reader.next().unwrap() else { panic!("no header") };
    assert_eq!(header.capacities, StatedCapacities { landmarks: 2000, beams: 1440, history: 128, contours: 6144 });
}

#[test]
fn a_header_with_which_nothing_can_be_computed_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drive.agvlog");
    let mut wrong = parameters();
    wrong.reflectors.range_deviation = 0.0;
    Writer::begin(&path, &wrong, &[]).unwrap().finish().unwrap();
    let error = log::read(&path).unwrap_err().to_string();
    let expected = "the log's header cannot be used: reflectors.range_deviation is out of its bounds";
    assert_eq!(error, format!("{}: {expected}", path.display()));
}

#[test]
fn what_is_flushed_is_on_the_disk() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drive.agvlog");
    let header = Header { software: "test", parameters: &parameters(), capacities: StatedCapacities::default() };
    let mut writer = Writer::create(&path, &header).unwrap();
    writer.take_name().unwrap();
    writer.write(&Record::Note("one")).unwrap();
    writer.flush().unwrap();
    let (records, damages) = listed(&path).unwrap();
    assert_eq!((records.len(), damages.len()), (2, 0));
    drop(writer);
}

#[test]
fn other_files_are_refused_in_one_clear_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drive.agvlog");
    let refusal = |path: &Path| {
        let message = log::read(path).unwrap_err().to_string();
        assert!(!message.contains('\n'));
        message.strip_prefix(&path.display().to_string()).unwrap().to_owned()
    };
    assert_eq!(refusal(&path), ": there is no such file");
    assert!(refusal(folder.path()).contains("directory"));
    for (content, expected) in [
        (&b""[..], ": the file is empty"),
        (b"\x1f\x8b\x08\0\0\0\0\0", ": this is not a log of this program but gzip-compressed data"),
        (b"\xd4\xc3\xb2\xa1\x02\0\x04\0", ": this is not a log of this program but a network capture (pcap)"),
        (b"t_s,x_m,y_m\n1,2,3\n", ": this is not a log of this program but text"),
        (&[0; 10_000], ": this is not a log of this program but binary data of an unknown kind"),
    ] {
        std::fs::write(&path, content).unwrap();
        assert_eq!(refusal(&path), expected);
    }
    log::write(&path, &small_recording()).unwrap();
    let mut bytes = std::fs::read(&path).unwrap();
    let (records, _) = listed(&path).unwrap();
    bytes.drain(..records[1].0 as usize);
    std::fs::write(&path, &bytes).unwrap();
    let complaint = refusal(&path);
    let expected =
        ": the log's header, which tells the vehicle, is missing: this is a part of a log; agv replay PART --like";
    assert!(complaint.starts_with(expected), "{complaint}");
}

#[test]
fn two_drives_in_one_file_are_refused() {
    let (_folder, path) = written(&small_recording());
    let first = std::fs::read(&path).unwrap();
    let mut other = small_recording();
    *other.parameters.lasers.first_mut() = Pose::new(0.0, 0.0, 0.0);
    log::write(&path, &other).unwrap();
    let second = std::fs::read(&path).unwrap();
    std::fs::write(&path, [first.clone(), second].concat()).unwrap();
    assert!(matches!(log::read(&path), Err(LogError::SecondDrive { offset, .. }) if offset == first.len() as u64));
}

#[test]
fn a_log_of_another_version_is_refused() {
    // A note of format version 1: the layout of a frame is the same in all versions.
    let body = [0xD6, 0x41, 0x47, 0x56, 1, 11, 2, 0, 0, 0, 0, 0, b'h', b'i'];
    let checksum = !body.iter().fold(u32::MAX, |state, byte| {
        (0..8).fold(
            state ^ u32::from(*byte),
            |state, _| if state & 1 == 1 { 0xEDB8_8320 ^ (state >> 1) } else { state >> 1 },
        )
    });
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drive.agvlog");
    std::fs::write(&path, [&body[..], &checksum.to_le_bytes()].concat()).unwrap();
    let message = log::read(&path).unwrap_err().to_string();
    assert!(message.ends_with(": the log has format version 1, this program reads 11"), "{message}");
}
