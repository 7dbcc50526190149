//! Logs of scans: a few lines of each format, and the real files.

use std::f64::consts::{FRAC_PI_2, PI};
use std::io::Write;

use agv_core::geometry::Pose;
use agv_core::measurement::Time;
use agv_host_sim::import::{PosedScan, carmen, graph_log};
use agv_host_sim::text_file::TextFileError;
use agv_tests::recordings;
use flate2::Compression;
use flate2::write::GzEncoder;

fn file(name: &str, content: &[u8]) -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, content).unwrap();
    (folder, path)
}

const GRAPH: &str = "\
VERTEX2 0 1 2 1.5707963267948966
ROBOTLASER1 0 -1.5 3.0 1.0 50 0.1 0 4 1.5 81.91 2.5 3 0 7.5 7 0 7 7 0 0 0 0 0 0 100.5 host 0.25
VERTEX2 1 1 3 0
ROBOTLASER1 0 -1.5 3.0 1.0 50 0.1 0 2 1 2 3 7 8 9 0.5 0 0 0 0 0 0 0 0 0 0 101.75 host 1.5
# edges
EDGE2 0 1 1 0 -1.5 100 0 100 500 0 0
";

#[test]
fn graph_log_gives_scans_with_the_laser_where_it_sits_on_the_corrected_robot() {
    let (_folder, path) = file("graph.log", GRAPH.as_bytes());
    let graph = graph_log::read(&path).unwrap();
    let [first, second] = graph.log.scans.as_slice() else { panic!("two scans") };
    assert_eq!(first.scan.ranges, [1.5, 81.91, 2.5, 3.0]);
    assert_eq!((first.scan.first_bearing, first.scan.bearing_step), (-1.5, 1.0));
    assert_eq!(first.robot, Pose::new(1.0, 2.0, FRAC_PI_2));
    assert!((first.laser.position() - Pose::new(1.0, 2.5, 0.0).position()).norm() < 1e-12);
    assert_eq!(first.scan.start, Time::from_seconds(0.0));
    assert_eq!(second.scan.start, Time::from_seconds(1.25));
    assert_eq!(second.laser, Pose::new(1.5, 3.0, 0.0));
    assert_eq!((graph.edges[0].from, graph.edges[0].to), (0, 1));
    assert_eq!(graph.edges[0].displacement, Pose::new(1.0, 0.0, -1.5));
}

#[test]
fn a_graph_log_whose_times_go_back_keeps_scans_at_the_poses_of_their_lines() {
    let scan = |number: usize, seconds: f64| {
        format!(
            "VERTEX2 {number} {number} 0 0\nROBOTLASER1 0 -1.5 3.0 1.0 50 0.1 0 1 {number} 0 0 0 0 0 0 0 0 0 0 0 0 {seconds} host 0\n"
        )
    };
    let text: String =
        [100.0, 100.6, 102.0, 101.9, 102.5].iter().zip(1..).map(|(time, number)| scan(number, *time)).collect();
    let (_folder, path) = file("graph.log", text.as_bytes());
    let graph = graph_log::read(&path).unwrap();
    assert_eq!(graph.defects.backward, 1);
    let drive = agv_host_sim::import::drive(&graph.log).unwrap();
    let posed = PosedScan::of_recording(&drive);
    assert_eq!(posed.len(), 5);
    for posed in posed {
        assert!((posed.robot.x - f64::from(posed.scan.ranges[0])).abs() < 1e-9, "{posed:?}");
    }
    let (_folder, path) = file("graph.log", scan(1, f64::NAN).as_bytes());
    assert!(matches!(graph_log::read(&path).unwrap_err(), TextFileError::Line { line: 2, .. }));
}

#[test]
fn graph_log_says_which_line_is_wrong() {
    let (_folder, path) = file("graph.log", GRAPH.replace("2.5 3 0", "2.5 x 0").as_bytes());
    let error = graph_log::read(&path).unwrap_err();
    assert!(matches!(error, TextFileError::Line { line: 2, .. }), "{error}");
    let (_folder, path) = file("graph.log", GRAPH.split_once('\n').unwrap().1.as_bytes());
    assert!(matches!(graph_log::read(&path).unwrap_err(), TextFileError::Line { line: 1, .. }));
    let (_folder, path) = file("graph.log", b"VERTEX2 0 0 0 0\nROBOTLASER1 0 0 0 0 0 0 0 99999999999999999999\n");
    assert!(matches!(graph_log::read(&path).unwrap_err(), TextFileError::Line { line: 2, .. }));
    assert!(matches!(graph_log::read(&path.with_extension("no")).unwrap_err(), TextFileError::Missing { .. }));
}

const CARMEN: &str = "\
# message formats defined: PARAM SYNC ODOM FLASER RLASER
PARAM robot_use_laser on nohost 0
ODOM 0 0 0 0 0 0 10.0 host 10.0
ODOM 1 0 0 0 0 0 10.5 host 10.5
FLASER 4 1 2 3 4 0.9 0.1 0 0.8 0.1 0 10.5 host 10.5
ODOM 0.8 0.1 0 0 0 0 0 host 0
ODOM 0.8 0.6 0 0 0 0 11.0 host 11.0
RLASER 3 1 2 3 0 0 0 0 0 0 11.25 host 11.25
ROBOTLASER1 0 -1.5 3.0 1.0 50 0.1 0 2 5 6 0 0.5 0 0 0 0 0 0 0 0 0 0 12 host 12
";

#[test]
fn carmen_log_gives_scans_and_raw_odometry() {
    let mut packed = GzEncoder::new(Vec::new(), Compression::fast());
    packed.write_all(CARMEN.as_bytes()).unwrap();
    let (_plain_folder, plain) = file("carmen.log", CARMEN.as_bytes());
    let (_packed_folder, packed) = file("carmen.log.gz", &packed.finish().unwrap());
    let log = carmen::read(&plain).unwrap();
    assert_eq!(carmen::read(&packed).unwrap(), log);

    let [old, new] = log.front.scans.as_slice() else { panic!("two scans") };
    assert_eq!(old.scan.ranges, [1.0, 2.0, 3.0, 4.0]);
    assert_eq!((old.scan.first_bearing, old.scan.bearing_step), (-FRAC_PI_2, PI / 4.0));
    assert_eq!((old.laser, old.robot), (Pose::new(0.9, 0.1, 0.0), Pose::new(0.8, 0.1, 0.0)));
    assert_eq!(old.scan.start, Time::from_seconds(0.5));
    assert_eq!((new.scan.first_bearing, new.scan.bearing_step), (-1.5, 1.0));
    assert_eq!(new.laser, Pose::new(0.5, 0.0, 0.0));

    assert_eq!(log.rear.len(), 1);
    assert_eq!(log.rear[0].scan.bearing_step, PI / 2.0, "an odd number of beams measures both ends");

    let increments: Vec<_> = log.front.increments.iter().map(|increment| increment.displacement).collect();
    assert_eq!(increments.len(), 2, "the line with time zero moves the anchor only");
    assert!((increments[0].x - 1.0).abs() < 1e-12 && (increments[1].y - 0.5).abs() < 1e-12);
}

#[test]
fn carmen_log_says_which_line_is_wrong() {
    let (_folder, path) = file("carmen.log", CARMEN.replace("FLASER 4 1", "FLASER 400 1").as_bytes());
    let error = carmen::read(&path).unwrap_err();
    assert!(matches!(error, TextFileError::Line { line: 5, .. }), "{error}");
    let (_folder, path) = file("carmen.log.gz", b"this is not gzip");
    assert!(matches!(carmen::read(&path).unwrap_err(), TextFileError::Io { .. }));
}

/// The time of each line.
type Times<'a> = &'a dyn Fn(usize) -> String;

/// A straight drive of 1 m a line of odometry, a scan behind each second one, and corrected poses 0.1 m off that are
/// repeated: the times are what is asked for.
fn straight_drive(odometry: impl Fn(usize) -> String, scan: impl Fn(usize) -> String, repeat: &str) -> String {
    let mut text = "ODOM 0 0 0 0 0 0 100.0 host 0\n".to_owned();
    let mut x = 0.0;
    for line in 1..=8 {
        x += 1.0;
        text += &format!("ODOM {x} 0 0 0 0 0 {} host 0\n", odometry(line));
        if line % 2 == 0 {
            x += 0.1;
            text += &format!("FLASER 4 1 2 3 4 {x} 0 0 {x} 0 0 {} host 0\n", scan(line));
            text += &format!("ODOM {x} 0 0 0 0 0 {repeat} host 0\n");
        }
    }
    text
}

fn steps(log: &carmen::CarmenLog) -> Vec<f64> {
    log.front.increments.iter().map(|increment| increment.displacement.x).collect()
}

#[test]
fn times_that_contradict_the_lines_of_a_carmen_log_are_made_from_their_order() {
    let right = |line: usize| format!("{}", 100.0 + 0.5 * line as f64);
    let backward = |line: usize| format!("{}", 100.0 + 0.5 * line as f64 - if line == 5 { 0.9 } else { 0.0 });
    let rounded = |line: usize| format!("{:.0}", 100.0 + 0.25 * line as f64);
    let zero = |line: usize| if line > 4 { "0".to_owned() } else { right(line) };
    let late = |line: usize| format!("{}", 103.0 + 0.5 * line as f64);
    let read = |odometry: Times, scan: Times| {
        let (_folder, path) = file("carmen.log", straight_drive(odometry, scan, "0").as_bytes());
        carmen::read(&path).unwrap()
    };
    let good = read(&right, &right);
    assert!(good.defects.is_none() && good.front.scans[1].scan.start == Time::from_seconds(2.0));

    let wrong: [(Times, Times); 5] =
        [(&backward, &right), (&rounded, &rounded), (&right, &zero), (&right, &backward), (&right, &late)];
    for (number, (odometry, scan)) in wrong.into_iter().enumerate() {
        let log = read(odometry, scan);
        if number == 3 {
            assert!(log.defects.is_none(), "a scan is logged a little late");
            continue;
        }
        assert!(!log.defects.is_none(), "case {number}");
        assert!(log.defects.to_string().contains("order of the lines"), "{}", log.defects);
        assert!(steps(&log).iter().all(|step| (step - 1.0).abs() < 1e-9), "case {number}: {:?}", steps(&log));
        // Each scan stands where the line of odometry before it ended.
        for (scan, line) in log.front.scans.iter().zip((2..).step_by(2)) {
            assert_eq!(scan.scan.start, log.front.increments[line - 1].time, "case {number}");
        }
        assert!(log.front.increments.is_sorted_by(|a, b| a.time < b.time));
    }
}

#[test]
fn a_carmen_log_whose_times_are_no_numbers_of_this_world_is_refused_by_its_line() {
    let (_folder, path) = file("carmen.log", CARMEN.replace("11.0 host 11.0", "nan host 11.0").as_bytes());
    assert!(matches!(carmen::read(&path).unwrap_err(), TextFileError::Line { line: 7, .. }));
}

#[test]
fn a_repeated_corrected_pose_is_no_motion_whatever_its_time() {
    let right = |line: usize| format!("{}", 100.0 + 0.5 * line as f64);
    let text = straight_drive(right, right, "0");
    // One of the repeats has a time.
    let (_folder, path) =
        file("carmen.log", text.replacen("ODOM 2.1 0 0 0 0 0 0", "ODOM 2.1 0 0 0 0 0 101.25", 1).as_bytes());
    let log = carmen::read(&path).unwrap();
    assert!(log.defects.is_none());
    assert!(steps(&log).len() == 8 && steps(&log).iter().all(|step| (step - 1.0).abs() < 1e-9), "{:?}", steps(&log));

    // Raw odometry that a scan repeats is a motion: nothing in such a log has time zero.
    let raw = "ODOM 0 0 0 0 0 0 1 host 0\nFLASER 2 1 2 1 0 0 1 0 0 2 host 0\nODOM 1 0 0 0 0 0 2 host 0\n";
    let (_folder, path) = file("carmen.log", raw.as_bytes());
    assert_eq!(steps(&carmen::read(&path).unwrap()), [1.0]);
}

#[test]
fn intel_is_read_by_the_order_of_its_lines() {
    let Some(folder) = recordings("intel_is_read_by_the_order_of_its_lines", "scans2d") else { return };
    let log = carmen::read(&folder.join("intel-corrected.log.gz")).unwrap();
    assert!(log.defects.backward >= 600 && log.defects.equal > 1000, "{}", log.defects);
    // Between two lines of 0.2 s the robot moves by no more than it can; the corrections moved it further.
    let longest = steps(&log).into_iter().map(f64::abs).fold(0.0, f64::max);
    assert!(longest < 0.5, "{longest}");
    assert!(log.front.scans.is_sorted_by(|a, b| a.scan.start < b.scan.start));
}

#[test]
fn real_logs_have_the_scans_that_their_owners_count() {
    let Some(folder) = recordings("real_logs_have_the_scans_that_their_owners_count", "scans2d") else { return };
    for (name, scans, beams) in [("fr079.log", 1464, 360), ("intel-lab.log", 2672, 180)] {
        let graph = graph_log::read(&folder.join(name)).unwrap();
        assert_eq!(graph.log.scans.len(), scans);
        assert!(graph.log.scans.iter().all(|scan| scan.scan.ranges.len() == beams));
        assert!(graph.edges.iter().all(|edge| edge.from < scans && edge.to < scans));
    }
    for (name, scans, beams, motions) in [
        ("aces-corrected.log.gz", 440, 180, 7373),
        ("fhw-corrected.log.gz", 488, 180, 13446),
        ("freiburg-079-corrected.log.gz", 4791, 360, 4933),
    ] {
        let log = carmen::read(&folder.join(name)).unwrap();
        assert_eq!(log.front.scans.len(), scans);
        assert!(log.front.scans.iter().all(|scan| scan.scan.ranges.len() == beams));
        assert_eq!(log.front.increments.len(), motions);
    }
}
