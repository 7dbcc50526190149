//! Recordings of ROS 2 as vehicles of others leave them: the same drive, or a word of what is wrong.
#![cfg(feature = "bags")]
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::collections::BTreeMap;
use std::path::Path;

use agv_core::geometry::Pose as PlanarPose;
use agv_host_sim::import::ros::{self, Choice, RosImportError};
use agv_host_sim::import::{ImportSummary, Imported};
use agv_host_sim::recording::{RecordedEvent, RecordedScan};
use agv_host_sim::ros::encode;
use agv_host_sim::ros::messages::{
    Header, Imu, LaserScan, Odometry, Pose, PoseWithCovariance, PoseWithCovarianceStamped, Quaternion, Stamp,
    TransformStamped, Transforms, Twist, TwistWithCovariance, Vector,
};
use mcap::records::MessageHeader;
use proptest::prelude::*;
use serde::Serialize;

/// When the drive begins, ns.
const EPOCH: i64 = 1_700_000_000_000_000_000;
const MILLI: i64 = 1_000_000;

#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant, reason = "there are a few hundred of them")]
enum Content {
    Scan(LaserScan),
    Odometry(Odometry),
    Transforms(Transforms),
    InitialPose(PoseWithCovarianceStamped),
    Imu(Imu),
}

#[derive(Clone, Debug)]
struct Message {
    topic: String,
    received: i64,
    content: Content,
}

fn stamp(nanoseconds: i64) -> Stamp {
    Stamp {
        sec: i32::try_from(nanoseconds.div_euclid(1_000_000_000)).unwrap(),
        nanosec: u32::try_from(nanoseconds.rem_euclid(1_000_000_000)).unwrap(),
    }
}

fn header(nanoseconds: i64, frame: &str) -> Header {
    Header { stamp: stamp(nanoseconds), frame_id: frame.to_owned() }
}

fn transform(parent: &str, child: &str, x: f64) -> TransformStamped {
    TransformStamped {
        header: header(EPOCH, parent),
        child_frame_id: child.to_owned(),
        transform: Pose { position: Vector { x, y: 0.0, z: 0.2 }, orientation: Quaternion::default() },
    }
}

/// Where the vehicle is after that many steps of 50 ms: on an arc of 2 m, a metre a second.
fn place(step: u32) -> PlanarPose {
    let turned = 0.025 * f64::from(step);
    PlanarPose::new(2.0 * turned.sin(), 2.0 * (1.0 - turned.cos()), turned)
}

fn odometry(step: u32, at: i64) -> Odometry {
    Odometry {
        header: header(at, "odom"),
        child_frame_id: "base_link".to_owned(),
        pose: PoseWithCovariance { pose: place(step).into(), ..PoseWithCovariance::default() },
        twist: TwistWithCovariance {
            twist: Twist { linear: Vector { x: 1.0, y: 0.0, z: 0.0 }, angular: Vector { x: 0.0, y: 0.0, z: 0.5 } },
            ..TwistWithCovariance::default()
        },
    }
}

fn scan(at: i64) -> LaserScan {
    LaserScan {
        header: header(at, "laser"),
        angle_min: -std::f32::consts::FRAC_PI_2,
        angle_max: std::f32::consts::FRAC_PI_2,
        angle_increment: std::f32::consts::PI / 180.0,
        time_increment: 1e-4,
        scan_time: 0.1,
        range_min: 0.05,
        range_max: 30.0,
        ranges: (0..181_u16).map(|beam| 2.0 + f32::from(beam) * 0.01).collect(),
        intensities: vec![100.0; 181],
    }
}

/// Five seconds: odometry every 50 ms, a scan every 100 ms, received 2 and 4 ms later.
fn drive() -> Vec<Message> {
    let message = |topic: &str, received, content| Message { topic: topic.to_owned(), received, content };
    let mut messages = vec![message(
        "/tf_static",
        EPOCH - 500 * MILLI,
        Content::Transforms(Transforms { transforms: vec![transform("base_link", "laser", 0.3)] }),
    )];
    for step in 0..100_u32 {
        let at = EPOCH + 50 * MILLI * i64::from(step);
        messages.push(message("/odom", at + 2 * MILLI, Content::Odometry(odometry(step, at))));
        if step % 2 == 0 {
            messages.push(message("/scan", at + 4 * MILLI, Content::Scan(scan(at))));
        }
    }
    messages
}

fn bytes_of(messages: &[Message], encoding: &str, chunk: Option<u64>) -> Vec<u8> {
    let mut file = std::io::Cursor::new(Vec::new());
    let mut writer = mcap::WriteOptions::new().chunk_size(chunk).create(&mut file).unwrap();
    let mut channels: BTreeMap<String, u16> = BTreeMap::new();
    fn cdr<T: Serialize>(message: &T) -> Vec<u8> {
        encode(message).unwrap()
    }
    for (sequence, Message { topic, received, content }) in (0..).zip(messages) {
        let (kind, data) = match content {
            Content::Scan(message) => ("sensor_msgs/msg/LaserScan", cdr(message)),
            Content::Odometry(message) => ("nav_msgs/msg/Odometry", cdr(message)),
            Content::Transforms(message) => ("tf2_msgs/msg/TFMessage", cdr(message)),
            Content::InitialPose(message) => ("geometry_msgs/msg/PoseWithCovarianceStamped", cdr(message)),
            Content::Imu(message) => ("sensor_msgs/msg/Imu", cdr(message)),
        };
        let channel_id = *channels.entry(topic.clone()).or_insert_with(|| {
            let schema = writer.add_schema(kind, "ros2msg", b"").unwrap();
            writer.add_channel(schema, topic, encoding, &BTreeMap::new()).unwrap()
        });
        let time = u64::try_from(*received).unwrap();
        let header = MessageHeader { channel_id, sequence, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, &data).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    file.into_inner()
}

fn read_bytes(bytes: &[u8], choice: &Choice) -> Result<Imported, RosImportError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drive.mcap");
    std::fs::write(&path, bytes).unwrap();
    ros::read(&path, choice)
}

fn read(messages: &[Message]) -> Imported {
    read_bytes(&bytes_of(messages, "cdr", None), &Choice::default()).unwrap()
}

fn changed(change: impl Fn(usize, &mut Message)) -> Vec<Message> {
    let mut messages = drive();
    messages.iter_mut().enumerate().for_each(|(number, message)| change(number, message));
    messages
}

fn each_odometry(change: impl Fn(usize, &mut Odometry)) -> Vec<Message> {
    changed(|number, message| {
        if let Content::Odometry(odometry) = &mut message.content {
            change(number, odometry);
        }
    })
}

fn each_scan(change: impl Fn(usize, &mut LaserScan)) -> Vec<Message> {
    changed(|number, message| {
        if let Content::Scan(scan) = &mut message.content {
            change(number, scan);
        }
    })
}

fn scans(imported: &Imported) -> Vec<&RecordedScan> {
    let events = imported.recording.events.iter();
    events
        .filter_map(|event| match event {
            RecordedEvent::Scan(scan) => Some(scan),
            _ => None,
        })
        .collect()
}

fn warnings(imported: &Imported) -> Vec<String> {
    ImportSummary::of(&imported.recording, &imported.account).warnings
}

/// The drive is the one that was driven, and every scan stands where it was taken.
fn assert_is_the_drive(imported: &Imported, case: &str) {
    let mut pose = PlanarPose::default();
    let (mut steps, mut seen) = (0, 0);
    for event in &imported.recording.events {
        match event {
            RecordedEvent::Increment(increment) => {
                pose = pose.compose(&increment.displacement);
                let right = place(steps);
                let away = (pose.position() - right.position()).norm();
                assert!(away < 0.01 && (pose.theta - right.theta).abs() < 0.01, "{case}: {pose:?} {right:?}");
                let late = increment.time.micros().abs_diff(50_000 * u64::from(steps));
                assert!(late <= 5000, "{case}: step {steps} at {:?}", increment.time);
                steps += 1;
            }
            RecordedEvent::Scan(scan) => {
                assert!(
                    scan.start.micros().abs_diff(100_000 * seen) <= 5000,
                    "{case}: scan {seen} at {:?}",
                    scan.start
                );
                assert!((scan.view().bearing(180).to_degrees() - 90.0).abs() < 0.01, "{case}");
                assert!((scan.ranges[100] - 3.0).abs() < 1e-5 && scan.intensities.len() == 181, "{case}");
                seen += 1;
            }
            _ => {}
        }
    }
    assert_eq!((steps, seen), (100, 50), "{case}");
    let laser = imported.recording.parameters.lasers.first();
    assert_eq!((laser.x, laser.y, laser.theta), (0.3, 0.0, 0.0), "{case}");
}

#[test]
fn what_can_be_mended_is_and_is_told() {
    let no_change = |_: usize, _: &mut Message| {};
    // What was changed, the messages, and how many warnings there are.
    let cases: Vec<(&str, Vec<Message>, usize)> = vec![
        ("nothing", changed(no_change), 0),
        (
            "one stamp of zero",
            each_odometry(|number, one| {
                if number == 40 {
                    one.header.stamp = stamp(0)
                }
            }),
            1,
        ),
        (
            "first stamp of -1 s",
            each_odometry(|number, one| {
                if number == 1 {
                    one.header.stamp = stamp(-1_000_000_000)
                }
            }),
            1,
        ),
        (
            "a scan of an hour ago",
            each_scan(|number, one| {
                if number == 62 {
                    one.header.stamp.sec -= 3600
                }
            }),
            1,
        ),
        ("scans since power-on", each_scan(|_, one| one.header.stamp.sec -= 1_699_999_900), 1),
        ("scans without stamps", each_scan(|_, one| one.header.stamp = stamp(0)), 1),
        ("no pose, speeds alone", each_odometry(|_, one| one.pose = PoseWithCovariance::default()), 0),
        ("an angle of zero between beams", each_scan(|_, one| one.angle_increment = 0.0), 1),
        ("limits that are none", each_scan(|_, one| (one.range_min, one.range_max) = (0.0, 0.0)), 1),
        ("a negative time between beams", each_scan(|_, one| one.time_increment = -1.0), 1),
        ("frames with the vehicle's name", each_odometry(|_, one| one.child_frame_id = "agv7/base_link".to_owned()), 0),
        ("a footprint", each_odometry(|_, one| one.child_frame_id = "base_footprint".to_owned()), 0),
    ];
    for (case, messages, count) in cases {
        let imported = read(&messages);
        assert_is_the_drive(&imported, case);
        let warnings = warnings(&imported);
        assert_eq!(warnings.len(), count, "{case}: {warnings:?}");
    }
}

#[test]
fn the_last_static_transform_counts() {
    let moved = changed(|_, message| {
        if let Content::Transforms(all) = &mut message.content {
            all.transforms.insert(0, transform("base_link", "laser", 9.0));
        }
    });
    let imported = read(&moved);
    assert_is_the_drive(&imported, "two transforms");
    assert_eq!(imported.account.notes().len(), 1);
}

#[test]
fn what_cannot_be_used_is_left_out_with_its_place() {
    for (case, orientation) in [
        ("zeros", Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 0.0 }),
        ("no numbers", Quaternion { x: 0.0, y: 0.0, z: f64::NAN, w: 1.0 }),
        ("no rotation", Quaternion { x: 0.0, y: 0.0, z: 3.0, w: 4.0 }),
    ] {
        let imported = read(&each_odometry(|number, one| {
            if number % 10 == 0 {
                one.pose.pose.orientation = orientation;
            }
        }));
        let left_out = imported.account.left_out();
        assert!(left_out.len() == 1 && left_out[0].first.is_some(), "{case}: {left_out:?}");
        assert!(warnings(&imported).iter().any(|warning| warning.contains("were left out")), "{case}");
        // The way across what was left out is not lost.
        let way = imported.recording.events.iter().fold(PlanarPose::default(), |pose, event| match event {
            RecordedEvent::Increment(increment) => pose.compose(&increment.displacement),
            _ => pose,
        });
        assert!((way.position() - place(99).position()).norm() < 0.1, "{case}: {way:?}");
    }
    let all = read_bytes(
        &bytes_of(
            &each_odometry(|_, one| {
                one.pose.pose.orientation = Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 0.0 };
                one.twist = TwistWithCovariance::default();
            }),
            "cdr",
            None,
        ),
        &Choice::default(),
    );
    let error = all.map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("none of the 100 messages of /odom can be used: 100 messages"), "{error}");
    let imported = read(&each_scan(|number, one| {
        if number < 30 {
            one.angle_min = f32::NAN
        }
    }));
    assert!(scans(&imported).len() < 50 && !imported.account.left_out().is_empty());
}

#[test]
fn a_second_run_goes_on_behind_the_first() {
    let again = changed(|number, message| {
        if number > 75 {
            let back = 2500 * MILLI;
            match &mut message.content {
                Content::Scan(one) => one.header.stamp = stamp(one.header.stamp.nanoseconds() - back),
                Content::Odometry(one) => one.header.stamp = stamp(one.header.stamp.nanoseconds() - back),
                _ => {}
            }
        }
    });
    let imported = read(&again);
    assert_is_the_drive(&imported, "a clock that was set");
    assert_eq!(warnings(&imported).len(), 1, "{:?}", warnings(&imported));
}

#[test]
fn a_told_pose_without_a_covariance_is_no_certain_one() {
    for (case, covariance, expected) in [
        ("good", [[0.04; 6]; 6], (0.2, 0.2)),
        ("NaN", [[f64::NAN; 6]; 6], (0.5, 0.2617)),
        ("zero", [[0.0; 6]; 6], (0.5, 0.2617)),
        ("negative", [[-1.0; 6]; 6], (0.5, 0.2617)),
    ] {
        let mut messages = drive();
        let told = PoseWithCovarianceStamped {
            header: header(EPOCH + 100 * MILLI, "map"),
            pose: PoseWithCovariance { pose: PlanarPose::new(1.0, 2.0, 0.5).into(), covariance },
        };
        messages.insert(
            5,
            Message {
                topic: "/agv7/initialpose".to_owned(),
                received: EPOCH + 101 * MILLI,
                content: Content::InitialPose(told),
            },
        );
        let imported = read(&messages);
        let fix = imported.recording.events.iter().find_map(|event| match event {
            RecordedEvent::SetPose(fix) => Some(*fix),
            _ => None,
        });
        let fix = fix.unwrap_or_else(|| panic!("{case}: {:?}", imported.account));
        let found = (fix.position_deviation, fix.heading_deviation);
        assert!((found.0 - expected.0).abs() < 1e-9 && (found.1 - expected.1).abs() < 1e-9, "{case}: {found:?}");
        assert_eq!(warnings(&imported).len(), usize::from(case != "good"), "{case}: {:?}", warnings(&imported));
    }
}

#[test]
fn a_laser_that_hangs_tilted_is_turned_over_where_it_is_stated() {
    let roll = std::f64::consts::PI - 7.0_f64.to_radians();
    let hung = changed(|_, message| {
        if let Content::Transforms(all) = &mut message.content {
            let (x, w) = (0.5 * roll).sin_cos();
            all.transforms[0].transform.orientation = Quaternion { x, y: 0.0, z: 0.0, w };
        }
    });
    let bytes = bytes_of(&hung, "cdr", None);
    let error = read_bytes(&bytes, &Choice::default()).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("tilted by 7 deg") && error.contains("--laser"), "{error}");
    let stated = Choice { laser: Some(PlanarPose::new(0.3, 0.0, 0.0)), ..Choice::default() };
    let imported = read_bytes(&bytes, &stated).unwrap();
    assert!(scans(&imported).iter().all(|scan| scan.bearing_step < 0.0));
    assert_eq!(warnings(&imported).len(), 1, "{:?}", warnings(&imported));
}

#[test]
fn a_gyro_tells_numbers_only() {
    let mut messages = drive();
    for step in 0..100_i64 {
        let at = EPOCH + 50 * MILLI * step;
        let rate = if step % 20 == 3 { f64::NAN } else { 0.5 };
        let imu =
            Imu { header: header(at, "imu"), angular_velocity: Vector { x: 0.0, y: 0.0, z: rate }, ..Imu::default() };
        messages.push(Message { topic: "/imu".to_owned(), received: at + MILLI, content: Content::Imu(imu) });
    }
    let imported = read(&messages);
    let rates = imported.recording.events.iter().filter(|event| matches!(event, RecordedEvent::Gyro(_))).count();
    assert_eq!((rates, imported.account.left_out()[0].count), (95, 5));
}

#[test]
fn strengths_of_any_unit_are_whole_numbers() {
    for (largest, expected) in [(100.0_f32, 100), (1.0, 255), (1e6, 65_535)] {
        let imported = read(&each_scan(|_, one| {
            one.intensities.iter_mut().enumerate().for_each(|(beam, value)| {
                *value = if beam % 2 == 0 { largest } else { 0.5 * largest + 0.25 * largest.min(1.0) };
            });
        }));
        assert_eq!(scans(&imported)[0].intensities[0], expected, "{largest}");
        assert!(scans(&imported)[0].intensities[1] > 0, "{largest}");
    }
}

#[test]
fn a_recording_is_read_up_to_where_it_was_cut() {
    let whole = bytes_of(&drive(), "cdr", Some(4096));
    let mut fewest = usize::MAX;
    for share in [95, 80, 50, 30] {
        let imported = read_bytes(&whole[..whole.len() * share / 100], &Choice::default()).unwrap();
        let count = imported.recording.events.len();
        assert!(count < fewest && count > 20, "{share}: {count}");
        fewest = count;
        let said = warnings(&imported);
        assert!(said.iter().any(|warning| warning.contains("read up to the damage")), "{share}: {said:?}");
    }
}

#[test]
fn other_encodings_and_folders_without_a_description() {
    let error = read_bytes(&bytes_of(&drive(), "ros1", None), &Choice::default()).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("encoded as ros1") && error.contains("rosbags-convert"), "{error}");
    let folder = tempfile::tempdir().unwrap();
    let messages = drive();
    std::fs::write(folder.path().join("drive_0.mcap"), bytes_of(&messages[..100], "cdr", None)).unwrap();
    let packed = zstd::stream::encode_all(&bytes_of(&messages[100..], "cdr", None)[..], 3).unwrap();
    std::fs::write(folder.path().join("drive_1.mcap.zstd"), packed).unwrap();
    let imported = ros::read(folder.path(), &Choice::default()).unwrap();
    assert_is_the_drive(&imported, "a folder");
    let described = "rosbag2_bagfile_information:\n  relative_file_paths: [drive_0.mcap, drive_1.mcap.zstd]\n  \
                     compression_format: zstd\n  compression_mode: FILE\n";
    std::fs::write(folder.path().join("metadata.yaml"), described).unwrap();
    assert_is_the_drive(&ros::read(folder.path(), &Choice::default()).unwrap(), "a described folder");
    let empty = tempfile::tempdir().unwrap();
    let error = ros::read(empty.path(), &Choice::default()).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("metadata.yaml"), "{error}");
}

#[test]
fn messages_that_are_compressed_one_by_one_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path: &Path = &folder.path().join("drive.db3");
    let database = rusqlite::Connection::open(path).unwrap();
    database
        .execute_batch(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT, offered_qos_profiles TEXT);
             CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);
             INSERT INTO topics VALUES (1, '/odom', 'nav_msgs/msg/Odometry', 'cdr', ''), (2, '/scan', 'sensor_msgs/msg/LaserScan', 'cdr', ''),
             (3, '/tf_static', 'tf2_msgs/msg/TFMessage', 'cdr', '');",
        )
        .unwrap();
    for message in drive() {
        let (topic, data) = match &message.content {
            Content::Odometry(one) => (1, encode(one).unwrap()),
            Content::Scan(one) => (2, encode(one).unwrap()),
            Content::Transforms(one) => (3, encode(one).unwrap()),
            _ => continue,
        };
        let packed = zstd::stream::encode_all(&data[..], 1).unwrap();
        database
            .execute(
                "INSERT INTO messages(topic_id, timestamp, data) VALUES (?1, ?2, ?3)",
                rusqlite::params![topic, message.received, packed],
            )
            .unwrap();
    }
    drop(database);
    assert_is_the_drive(&ros::read(path, &Choice::default()).unwrap(), "compressed messages");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn scans_of_any_shape_come_back(
        degrees in 90.0_f32..=360.0,
        beams in 2_usize..2000,
        is_clockwise in any::<bool>(),
        has_increment in any::<bool>(),
    ) {
        let sign = if is_clockwise { -1.0 } else { 1.0 };
        let (first, last) = (-sign * degrees.to_radians() / 2.0, sign * degrees.to_radians() / 2.0);
        let step = (last - first) / (beams - 1) as f32;
        let imported = read(&each_scan(|_, one| {
            (one.angle_min, one.angle_max) = (first, last);
            one.angle_increment = if has_increment { step } else { 0.0 };
            one.ranges = vec![4.0; beams];
            one.intensities.clear();
        }));
        for scan in scans(&imported) {
            prop_assert_eq!(scan.ranges.len(), beams);
            prop_assert!((scan.view().bearing(0) - f64::from(first)).abs() < 1e-4);
            prop_assert!((scan.view().bearing(beams - 1) - f64::from(last)).abs() < 1e-2);
        }
        prop_assert_eq!(warnings(&imported).len(), usize::from(!has_increment));
    }

    #[test]
    fn no_bytes_are_too_much(at in 0_usize..4000, with in any::<u8>(), length in 0_usize..20_000) {
        let mut bytes = bytes_of(&drive()[..20], "cdr", Some(512));
        let place = at % bytes.len();
        bytes[place] ^= with;
        bytes.truncate(length.max(1));
        let _ = read_bytes(&bytes, &Choice::default());
    }
}
