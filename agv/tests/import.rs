//! Recordings of others become drives.

use std::path::Path;

use agv_core::geometry::Pose;
use agv_core::measurement::{LaserId, PoseIncrement, Time};
use agv_core::odometry::{CounterRange, Tricycle, Vehicle};
use agv_host_sim::import::{PosedScan, ScanLog, carmen, carpark, drive, graph_log, sapienza};
use agv_host_sim::log;
use agv_host_sim::recording::{RecordedEvent, RecordedScan, Recording, Reference};
use agv_host_sim::text_file::TextFileError;
use agv_tests::recordings;

fn survives_a_log(recording: &Recording) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drive.agvlog");
    log::write(&path, recording).unwrap();
    let (again, damages) = log::read(&path).unwrap();
    assert!(again == *recording && damages.is_empty());
}

const TRICYCLE: &str = "#kinematic_model: traction_drive_wheel
#parameters: [ Ksteer Ktraction axis_length steer_offset ]
#parameter_values: 0.1 0.0106141 1.4 0.01
#joints_max_enc: [ steering traction_wheel ]
#joints_max_enc_values: 8192 5000
#laser wrt base_link
#\ttranslation:\t[ 1.5, 0.25, 0 ],
#\trotation:\t [ 0, 0, 0.3826834323650898, 0.9238795325112867 ]
time: 1668091584.821040869 ticks: 290 4294859756 model_pose: 0 0 0 tracker_pose: 6.50242e-05 -0.00354605 0.000941697
time: 1668091584.862079620 ticks: 8001 4 model_pose: 0 0 0 tracker_pose: 0.00101071 -0.00602303 0.00124475
";

fn tricycle(text: &str) -> Result<Recording, TextFileError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dataset.txt");
    std::fs::write(&path, text).unwrap();
    sapienza::read(&path)
}

#[test]
fn the_tricycle_keeps_its_counters() {
    let recording = tricycle(TRICYCLE).unwrap();
    let Vehicle::Tricycle(vehicle) = recording.parameters.vehicle else { panic!() };
    assert_eq!(
        vehicle,
        Tricycle {
            wheelbase: 1.4,
            drive_scale: 0.0106141 / 5000.0,
            drive_range: CounterRange::BITS_32,
            steering_scale: 0.1 * std::f64::consts::TAU / 8192.0,
            steering_range: CounterRange::new(8192).unwrap(),
            steering_offset_forward: 0.01,
            steering_offset_backward: 0.01,
        }
    );
    let laser = *recording.parameters.lasers.first();
    assert_eq!((laser.x, laser.y), (1.5, 0.25));
    assert!((laser.theta - std::f64::consts::FRAC_PI_4).abs() < 1e-12);
    let RecordedEvent::Encoders(second) = recording.events[1] else { panic!() };
    assert_eq!((second.time, second.drive, second.steering), (Time::from_micros(41_039), 4, 8001));
    assert_eq!(vehicle.steering_range.signed(second.steering), 8001 - 8192);
    assert_eq!(vehicle.drive_range.step(4_294_859_756, 4), 107_544);
    assert_eq!(recording.references[0].heading, Some(0.000941697));
}

#[test]
fn bad_tricycle_files_are_refused_with_the_line() {
    let cases = [
        (TRICYCLE.replace("ticks: 8001 4", "ticks: 8001"), ":10: the line is no sample"),
        (TRICYCLE.replace("ticks: 8001 4", "ticks: 8001 -4"), ":10: the line is no sample"),
        (TRICYCLE.replace("0.00124475", "abc"), ":10: the line is no sample"),
        (TRICYCLE.replace("584.862", "583.862"), ":10: time runs backward"),
        (TRICYCLE.replace("8192 5000", "8192"), ":5: this header is not understood"),
        (TRICYCLE.replace("#parameter_values", "#other"), ":1: the header does not state the vehicle's parameters"),
        ("t_s,x\n1,2\n".into(), ": this is not a tricycle dataset of the Sapienza University but text"),
        (String::new(), ": there are no data in the file"),
    ];
    for (text, expected) in cases {
        let message = tricycle(&text).unwrap_err().to_string();
        assert!(message.contains(expected) && !message.contains('\n'), "{message}");
    }
    // A line that was cut while it was written.
    assert!(tricycle(&TRICYCLE[..TRICYCLE.len() - 40]).is_err());
}

#[test]
fn the_real_tricycle_data_are_read() {
    let Some(folder) = recordings("the_real_tricycle_data_are_read", "sapienza_tricycle") else { return };
    let recording = sapienza::read(&folder.join("dataset.txt")).unwrap();
    assert_eq!((recording.events.len(), recording.references.len()), (2434, 2434));
    let RecordedEvent::Encoders(last) = recording.events[2433] else { panic!() };
    assert!((last.time.seconds() - 113.354).abs() < 1e-3);
    survives_a_log(&recording);
}

fn write_carpark(folder: &Path) {
    let scan = |first: &str, value: &str| format!("{first}{}\n", format!(",{value}").repeat(361));
    for (name, content) in [
        ("odometry.csv", "t_s,v,steer\n1.0,2.5,0.25\n1.1,2.6,0.26\n".to_owned()),
        ("laser_ranges_m.csv", format!("{}{}", scan("1.05", "7.25"), scan("1.15", "81.87"))),
        ("laser_intensity.csv", format!("{}{}", scan("1.05", "8192"), scan("1.15", "0"))),
        ("beacons.csv", "x_m,y_m\n1.5,-2.5\n3.0,4.0\n".to_owned()),
        ("gps.csv", "t_s,x_m,y_m\n1.02,10.0,20.0\n".to_owned()),
        ("events.csv", "t_s,sensor,row0\n1.0,2,0\n1.02,1,0\n1.05,3,0\n1.1,2,1\n1.15,3,1\n".to_owned()),
    ] {
        std::fs::write(folder.join(name), content).unwrap();
    }
}

#[test]
fn the_car_park_tables_become_a_drive() {
    let folder = tempfile::tempdir().unwrap();
    write_carpark(folder.path());
    let recording = carpark::read(folder.path(), &(0.0..=10.0)).unwrap();
    assert_eq!(recording.events.len(), 4);
    let RecordedEvent::Speed(sample) = recording.events[0] else { panic!() };
    assert_eq!((sample.time, sample.speed, sample.steering), (Time::from_micros(1_000_000), 2.5, 0.25));
    let RecordedEvent::Scan(scan) = &recording.events[1] else { panic!() };
    assert_eq!((scan.ranges.len(), scan.ranges[0], scan.intensities[360]), (361, 7.25, 8192));
    assert!((scan.view().bearing(0).to_degrees() + 90.0).abs() < 1e-9);
    assert!((scan.view().bearing(360).to_degrees() - 90.0).abs() < 1e-9);
    let RecordedEvent::Scan(scan) = &recording.events[3] else { panic!() };
    assert!(scan.ranges.iter().all(|range| *range == 0.0));
    assert_eq!(recording.references.len(), 1);
    assert_eq!((recording.references[0].x, recording.references[0].heading), (10.0, None));
    assert_eq!((recording.landmarks.len(), recording.landmarks[1].id, recording.landmarks[1].y), (2, 1, 4.0));
    assert_eq!(carpark::read(folder.path(), &(1.05..=1.1)).unwrap().events.len(), 2);
    survives_a_log(&recording);
}

#[test]
fn bad_car_park_tables_are_refused_with_the_line() {
    let folder = tempfile::tempdir().unwrap();
    for (name, content, expected) in [
        ("gps.csv", "t_s,x_m,y_m\n1.02,10.0\n", "gps.csv:2: there are 2 columns instead of 3"),
        ("gps.csv", "t_s,x_m,y_m\n1.02,10.0,abc\n", "gps.csv:2: column 3 is no number: \"abc\""),
        ("gps.csv", "t_s,x_m,y_m\n1.02,10.0,inf\n", "gps.csv:2: column 3 is no number: \"inf\""),
        ("gps.csv", "", "gps.csv: there are no data in the file"),
        ("gps.csv", "t_s,x_m,y_m\n", "gps.csv: there are no data in the file"),
        (
            "odometry.csv",
            "\u{1f}\u{0}\u{0}",
            "odometry.csv: this is not a table of numbers but binary data of an unknown kind",
        ),
        ("events.csv", "1.0,2,0\n1.02,1,1\n", "events.csv:2: sensor 1 has no row 1"),
        ("events.csv", "1.0,2,0\n1.02,4,0\n", "events.csv:2: there is no sensor 4"),
        ("events.csv", "1.0,2,1\n", "events.csv:1: row 1 of sensor 2 is of another time"),
    ] {
        write_carpark(folder.path());
        std::fs::write(folder.path().join(name), content).unwrap();
        let message = carpark::read(folder.path(), &(0.0..=10.0)).unwrap_err().to_string();
        assert!(message.ends_with(expected) && !message.contains('\n'), "{message}");
    }
    write_carpark(folder.path());
    std::fs::write(folder.path().join("gps.csv"), [0xff, 0xfe, 0, 1]).unwrap();
    let message = carpark::read(folder.path(), &(0.0..=10.0)).unwrap_err().to_string();
    assert!(message.ends_with("this is not a table of numbers but binary data of an unknown kind"), "{message}");
    std::fs::remove_file(folder.path().join("gps.csv")).unwrap();
    let message = carpark::read(folder.path(), &(0.0..=10.0)).unwrap_err().to_string();
    assert!(message.ends_with("gps.csv: there is no such file"), "{message}");
}

#[test]
fn the_real_car_park_data_are_read() {
    let Some(folder) = recordings("the_real_car_park_data_are_read", "carpark") else { return };
    let recording = carpark::read(&folder, &carpark::WINDOW).unwrap();
    let scans = || {
        recording.events.iter().filter_map(|event| match event {
            RecordedEvent::Scan(scan) => Some(scan),
            _ => None,
        })
    };
    assert_eq!(recording.landmarks.len(), 15);
    assert!(scans().all(|scan| scan.ranges.len() == 361 && scan.intensities.len() == 361));
    // A reflector always has a range.
    let bright = scans().flat_map(|scan| scan.ranges.iter().zip(&scan.intensities)).filter(|(_, bright)| **bright > 0);
    let (with_range, all) = bright.fold((0, 0), |(with, all), (range, _)| (with + usize::from(*range > 0.0), all + 1));
    assert!(all > 500 && with_range == all, "{with_range} of {all}");
    survives_a_log(&recording);
}

#[test]
fn a_log_of_scans_becomes_a_drive() {
    let scan = |seconds, laser, robot| PosedScan {
        scan: RecordedScan {
            laser: LaserId::FIRST,
            start: Time::from_seconds(seconds),
            beam_interval: 0.0,
            first_bearing: 0.0,
            bearing_step: 0.1,
            ranges: vec![seconds as f32],
            intensities: vec![],
        },
        laser,
        robot,
    };
    let laser = Pose::new(0.5, -0.1, 0.2);
    let robots = [Pose::new(3.0, 4.0, 1.0), Pose::new(3.5, 4.25, 2.0), Pose::new(3.0, 5.0, -3.0)];
    let posed = |index: usize| scan(index as f64, robots[index].compose(&laser), robots[index]);
    let mut log = ScanLog { scans: (0..3).map(posed).collect(), increments: vec![] };

    let recording = drive(&log).unwrap();
    assert!(close(recording.parameters.lasers.first(), &laser));
    let moved = recording.events.iter().fold(robots[0], |pose, event| match event {
        RecordedEvent::Increment(increment) => pose.compose(&increment.displacement),
        _ => pose,
    });
    assert!(close(&moved, &robots[2]));
    let Reference { x, y, heading, .. } = recording.references[1];
    assert!(close(&Pose::new(x, y, heading.unwrap()), &robots[1].compose(&laser)));

    let increment = |seconds| PoseIncrement { time: Time::from_seconds(seconds), displacement: laser };
    log.increments = [0.5, 1.0, 1.5, 9.0].map(increment).to_vec();
    let recording = drive(&log).unwrap();
    let order: String =
        recording.events.iter().map(|event| if matches!(event, RecordedEvent::Scan(_)) { 's' } else { 'i' }).collect();
    assert_eq!(order, "siisisi");
    survives_a_log(&recording);

    log.scans.clear();
    assert!(drive(&log).is_none());
}

fn close(a: &Pose, b: &Pose) -> bool {
    let Pose { x, y, theta } = a.between(b);
    x.abs() < 1e-12 && y.abs() < 1e-12 && theta.abs() < 1e-12
}

#[test]
fn the_real_logs_of_scans_are_read() {
    let Some(folder) = recordings("the_real_logs_of_scans_are_read", "scans2d") else { return };
    let recordings = [
        (drive(&graph_log::read(&folder.join("fr079.log")).unwrap().log).unwrap(), 1464, 360),
        (drive(&carmen::read(&folder.join("aces-corrected.log.gz")).unwrap().front).unwrap(), 440, 180),
    ];
    for (recording, scans, beams) in recordings {
        let lengths: Vec<usize> = recording
            .events
            .iter()
            .filter_map(|event| match event {
                RecordedEvent::Scan(scan) => Some(scan.ranges.len()),
                _ => None,
            })
            .collect();
        assert_eq!(lengths, vec![beams; scans]);
        assert_eq!(recording.references.len(), scans);
        survives_a_log(&recording);
    }
}
