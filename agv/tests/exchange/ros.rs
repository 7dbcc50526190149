//! Recordings of ROS 2, against programs of others that read and write them.

use std::path::Path;

use agv_core::geometry::{Pose, difference};
use agv_core::localizer::Mode;
use agv_core::measurement::GyroSample;
use agv_host_sim::log;
use agv_host_sim::recording::RecordedEvent;
use agv_host_sim::replay::replay;
use agv_tests::python;
use serde_json::Value;

use super::hall::hall;
use crate::support::{Files, agv, refusal, text};

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(number).collect()
}

fn run(arguments: &[&str]) -> Value {
    let output = agv(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn an_export_is_read_by_others() {
    let Some(mut python) = python("an_export_is_read_by_others", "mcap, mcap_ros2, rosbags") else { return };
    let files = Files::new();
    let recording = hall(4.0);
    let answers = replay(&recording, |_| ()).unwrap();
    let [log_path, mcap, bag] = ["drive.agvlog", "drive.mcap", "drive_bag"].map(|name| files.path(name));
    log::write(Path::new(&log_path), &recording).unwrap();
    let counts = run(&["export", "mcap", &log_path, "-o", &mcap, "--json"]);
    assert_eq!(counts, run(&["export", "rosbag2", &log_path, "-o", &bag, "--json"]));
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/exchange/readers.py");
    let output = python.arg(script).args([&mcap, &bag]).output().unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    // Two readers that know nothing of each other find the same, all of it.
    assert_eq!(found["mcap"], found["rosbags"]);
    let found = &found["mcap"];
    for (topic, count) in counts.as_object().unwrap() {
        assert_eq!(found[topic].as_array().unwrap().len() as u64, count.as_u64().unwrap(), "{topic}");
    }
    // Poses and the chain of frames are what the localiser said.
    let said: Vec<_> = answers.poses.iter().filter(|pose| pose.mode != Mode::NotLocalised).collect();
    let poses = found["/pose"].as_array().unwrap();
    let transforms = found["/tf"].as_array().unwrap();
    assert_eq!((poses.len(), transforms.len()), (said.len(), said.len()));
    for ((said, pose), chain) in said.iter().zip(poses).zip(transforms) {
        let pose = numbers(pose);
        assert!((pose[0] - said.time.seconds()).abs() < 1e-9);
        assert!((pose[1] - said.pose.x).abs() < 1e-12 && (pose[2] - said.pose.y).abs() < 1e-12);
        assert!(difference(pose[3], said.pose.theta).abs() < 1e-12);
        let [xx, xy, yy, xt, yt, tt] = said.covariance;
        let expected = [(0, xx), (1, xy), (6, xy), (7, yy), (5, xt), (30, xt), (11, yt), (31, yt), (35, tt), (14, 0.0)];
        assert!(expected.iter().all(|(place, value)| (pose[4 + place] - value).abs() < 1e-15));
        let frames: Vec<Pose> = chain
            .as_array()
            .unwrap()
            .iter()
            .map(|step| Pose::new(number(&step[3]), number(&step[4]), number(&step[5])))
            .collect();
        assert_eq!((&chain[0][0], &chain[0][1], &chain[1][1]), (&"map".into(), &"odom".into(), &"base_link".into()));
        let composed = frames[0].compose(&frames[1]);
        assert!((composed.position() - said.pose.position()).norm() < 1e-9);
    }
    let truth = found["/truth"].as_array().unwrap();
    assert_eq!(truth.len(), recording.truth.len());
    assert!(truth.iter().zip(&recording.truth).all(|(found, truth)| (number(&found[1]) - truth.pose.x).abs() < 1e-12));
    let scans = recording.events.iter().filter_map(|event| match event {
        RecordedEvent::Scan(scan) => Some(scan),
        _ => None,
    });
    for (found, scan) in found["/scan"].as_array().unwrap().iter().zip(scans) {
        assert!((number(&found[0]) - scan.start.seconds()).abs() < 1e-9);
        let ranges = numbers(&found[4]);
        assert_eq!(ranges.len(), scan.ranges.len());
        let is_same = |(found, range): (&f64, &f32)| {
            if *range > 0.0 { (found - f64::from(*range)).abs() < 1e-9 } else { *found == -1.0 }
        };
        assert!(ranges.iter().zip(&scan.ranges).all(is_same));
    }
    let landmarks = found["/landmarks"][0][0][2].as_array().unwrap();
    assert_eq!(landmarks.len(), recording.landmarks.len());
    // Every observation is in the picture.
    let observed: usize = found["/observations"]
        .as_array()
        .unwrap()
        .iter()
        .flat_map(|message| message.as_array().unwrap())
        .map(|marker| marker[2].as_array().unwrap().len())
        .sum();
    assert_eq!(observed, answers.uses.len());
    let last = found["/diagnostics"].as_array().unwrap().last().unwrap();
    assert_eq!((&last[0][0], &last[0][1]), (&"localisation".into(), &0.into()));
    let told: f64 = last[0][3]["protection level of the position, m"].as_str().unwrap().parse().unwrap();
    assert!(answers.poses.iter().any(|pose| pose.level.position == told), "{told}");
}

#[test]
fn what_was_exported_is_imported() {
    let files = Files::new();
    let recording = hall(4.0);
    let [log_path, mcap, bag, back] = ["a.agvlog", "a.mcap", "bag", "b.agvlog"].map(|name| files.path(name));
    log::write(Path::new(&log_path), &recording).unwrap();
    run(&["export", "mcap", &log_path, "-o", &mcap, "--json"]);
    run(&["export", "rosbag2", &log_path, "-o", &bag, "--json"]);
    for (format, input) in [("mcap", &mcap), ("auto", &mcap), ("rosbag2", &bag), ("auto", &bag)] {
        run(&["import", format, input, "-o", &back, "--json"]);
        assert_eq!(log::read(Path::new(&back)).unwrap(), (recording.clone(), vec![]));
        // Who names a topic wants its messages.
        run(&["import", format, input, "-o", &back, "--json", "--scan-topic", "/scan"]);
        let (imported, _) = log::read(Path::new(&back)).unwrap();
        let (laser, known) = (*imported.parameters.lasers.first(), *recording.parameters.lasers.first());
        assert!((laser.position() - known.position()).norm() < 1e-12 && (laser.theta - known.theta).abs() < 1e-12);
        let scans = |events: &[RecordedEvent]| -> Vec<Vec<f32>> {
            let ranges = events.iter().filter_map(|event| match event {
                RecordedEvent::Scan(scan) => Some(scan.ranges.clone()),
                _ => None,
            });
            ranges.collect()
        };
        assert_eq!(scans(&imported.events), scans(&recording.events));
        // The increments add up to the way: the encoders of four seconds are good to some centimetres.
        let way = imported.events.iter().fold(Pose::default(), |pose, event| match event {
            RecordedEvent::Increment(increment) => pose.compose(&increment.displacement),
            _ => pose,
        });
        let truth = recording.truth[0].pose.between(&recording.truth.last().unwrap().pose);
        assert!((way.position() - truth.position()).norm() < 0.1, "{way:?} {truth:?}");
        assert!(truth.position().norm() > 1.0);
    }
}

#[test]
fn the_rates_of_a_gyro_come_back_as_they_were_told() {
    let files = Files::new();
    let mut recording = hall(4.0);
    recording.parameters.gyro.is_fitted = true;
    let (first, last) = (recording.truth[0].time, recording.truth.last().unwrap().time);
    // Beside each sample of the encoders one of a gyro that turns ever faster.
    let rates: Vec<GyroSample> = recording
        .events
        .iter()
        .filter_map(|event| event.is_odometry().then(|| event.time()).flatten())
        .filter(|time| (first..=last).contains(time))
        .map(|time| GyroSample { time, rate: 1e-3 * time.since(first) - 0.002 })
        .collect();
    recording.events.extend(rates.iter().copied().map(RecordedEvent::Gyro));
    recording.events.sort_by_key(RecordedEvent::time);
    let [log_path, mcap, bag, back] = ["a.agvlog", "a.mcap", "bag", "b.agvlog"].map(|name| files.path(name));
    log::write(Path::new(&log_path), &recording).unwrap();
    run(&["export", "mcap", &log_path, "-o", &mcap, "--json"]);
    run(&["export", "rosbag2", &log_path, "-o", &bag, "--json"]);
    for (format, input) in [("mcap", &mcap), ("rosbag2", &bag)] {
        run(&["import", format, input, "-o", &back, "--json", "--scan-topic", "/scan"]);
        let (imported, _) = log::read(Path::new(&back)).unwrap();
        let gyro = imported.parameters.gyro;
        assert!(gyro.is_fitted && (gyro.factor - 1.0).abs() < 1e-15);
        let again: Vec<f64> = imported
            .events
            .iter()
            .filter_map(|event| match event {
                RecordedEvent::Gyro(sample) => Some(sample.rate),
                _ => None,
            })
            .collect();
        assert!(again.len() > 300);
        assert_eq!(again, rates.iter().map(|sample| sample.rate).collect::<Vec<_>>());
    }
}

#[test]
fn the_recording_of_another_vehicle_is_imported() {
    let Some(_) = python("the_recording_of_another_vehicle_is_imported", "rosbags, numpy") else { return };
    let files = Files::new();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/exchange/vehicle_bag.py");
    for storage in ["mcap", "sqlite3"] {
        let [bag, back] = [storage.to_owned(), format!("{storage}.agvlog")].map(|name| files.path(&name));
        let mut python = python("the_recording_of_another_vehicle_is_imported", "rosbags, numpy").unwrap();
        let output = python.arg(&script).args([&bag, storage]).output().unwrap();
        assert!(output.status.success(), "{}", text(&output.stderr));
        let summary = run(&["import", "rosbag2", &bag, "-o", &back, "--json"]);
        assert_eq!((&summary["scans"], &summary["odometry"]), (&10.into(), &20.into()));
        let (imported, _) = log::read(Path::new(&back)).unwrap();
        let laser = *imported.parameters.lasers.first();
        assert!((laser.x - 1.2).abs() < 1e-12 && (laser.y - 0.5).abs() < 1e-12);
        assert!((laser.theta - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        let mut pose = Pose::default();
        let (mut steps, mut scans) = (0, 0);
        for event in &imported.events {
            match event {
                RecordedEvent::Increment(increment) => {
                    pose = pose.compose(&increment.displacement);
                    let angle = 0.1 * f64::from(steps);
                    assert!((pose.x - 2.0 * angle.sin()).abs() < 1e-9 && difference(pose.theta, angle).abs() < 1e-9);
                    assert_eq!(increment.time.micros(), 50_000 * u64::from(steps as u32));
                    steps += 1;
                }
                RecordedEvent::Scan(scan) => {
                    // It is known 36 ms after its first beam: behind the odometry of its beginning, before the next.
                    assert_eq!(scan.start.micros(), 100_000 * scans);
                    assert_eq!(steps as u64, 2 * scans + 1);
                    assert_eq!(scan.ranges[..3], [0.0; 3], "no return, no number, too far");
                    let third = 2.0 + 0.01 * 3.0 + 0.1 * (2 * scans) as f64;
                    assert!((f64::from(scan.ranges[3]) - third).abs() < 1e-6);
                    assert_eq!((scan.intensities[3], scan.intensities.len()), (900, 181));
                    assert!((scan.beam_interval - 0.0002).abs() < 1e-9 && (scan.bearing_step - 0.017_453).abs() < 1e-6);
                    scans += 1;
                }
                other => panic!("{other:?}"),
            }
        }
        let complaint = refusal(&["import", "rosbag2", &bag, "--scan-topic", "/rear/scan", "-o", &back]);
        assert!(complaint.contains("no topic /rear/scan") && complaint.contains("can be /front/scan"), "{complaint}");
    }
}

#[test]
fn a_laser_that_hangs_upside_down_shows_the_world_the_right_way_round() {
    let test = "a_laser_that_hangs_upside_down_shows_the_world_the_right_way_round";
    let Some(_) = python(test, "rosbags, numpy") else { return };
    let files = Files::new();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/exchange/vehicle_bag.py");
    let imported = |roll: &str, options: &[&str]| {
        let [bag, back] = [format!("bag{roll}"), format!("{roll}.agvlog")].map(|name| files.path(&name));
        if !Path::new(&bag).exists() {
            let output =
                python(test, "rosbags, numpy").unwrap().arg(&script).args([&bag, "mcap", roll]).output().unwrap();
            assert!(output.status.success(), "{}", text(&output.stderr));
        }
        (bag.clone(), agv(&[&["import", "rosbag2", &bag, "-o", &back], options].concat()), back)
    };
    for options in [&[][..], &["--laser", "1.2,0.5,90"]] {
        // A degree of tilt is that of any bracket.
        for (roll, sign) in [("0", 1.0), ("1", 1.0), ("180", -1.0), ("-179", -1.0)] {
            let (_, output, back) = imported(roll, options);
            assert!(output.status.success(), "{roll}: {}", text(&output.stderr));
            let (recording, _) = log::read(Path::new(&back)).unwrap();
            let laser = *recording.parameters.lasers.first();
            assert!((laser.x - 1.2).abs() < 1e-3 && (laser.y - 0.5).abs() < 1e-9);
            assert!((laser.theta - std::f64::consts::FRAC_PI_2).abs() < 1e-3);
            let scan = recording.events.iter().find_map(|event| match event {
                RecordedEvent::Scan(scan) => Some(scan),
                _ => None,
            });
            let scan = scan.unwrap();
            // The first beam looks to the right of the laser's first axis, or to the left of it if it hangs.
            assert!((scan.first_bearing + sign * std::f64::consts::FRAC_PI_2).abs() < 1e-6, "{roll}");
            assert!((scan.bearing_step - sign * 0.017_453).abs() < 1e-6, "{roll}");
        }
    }
    let (bag, output, _) = imported("30", &[]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains(&bag) && text(&output.stderr).contains("tilted by 30 deg"));
}

#[test]
fn what_is_no_recording_of_ros_is_refused() {
    let files = Files::new();
    let output = files.path("out.agvlog");
    let recording = hall(1.0);
    let [log_path, mcap] = ["a.agvlog", "a.mcap"].map(|name| files.path(name));
    log::write(Path::new(&log_path), &recording).unwrap();
    run(&["export", "mcap", &log_path, "-o", &mcap, "--json"]);
    let bytes = std::fs::read(&mcap).unwrap();
    // The log behind the messages is not what it was: that is said, and the messages are read.
    let mut damaged_log = bytes.clone();
    damaged_log[bytes.len() * 2 / 3] ^= 0x55;
    let input = files.write("damaged_log.mcap", &damaged_log);
    let doubtful = agv(&["import", "mcap", &input, "-o", &output, "--strict"]);
    assert_eq!(doubtful.status.code(), Some(3));
    assert!(text(&doubtful.stdout).contains("only its messages were read"), "{}", text(&doubtful.stdout));
    std::fs::remove_file(&output).unwrap();
    // Neither can be read.
    let mut damaged = damaged_log;
    damaged[bytes.len() / 20] ^= 0x55;
    std::fs::create_dir(files.path("folder")).unwrap();
    std::fs::create_dir(files.path("described")).unwrap();
    std::fs::write(files.path("described/metadata.yaml"), "rosbag2_bagfile_information: 7\n").unwrap();
    let inputs = [
        files.path("missing"),
        files.write("empty.mcap", b""),
        files.write("foreign.mcap", b"t_s,x_m\n1,2\n"),
        files.write("cut.mcap", &bytes[..300]),
        files.write("damaged.mcap", &damaged),
        files.write("broken.db3", b"SQLite format 3\0 and then nothing of use"),
        files.path("folder"),
        files.path("described"),
    ];
    for input in &inputs {
        let name = Path::new(input).file_name().unwrap().to_str().unwrap();
        for format in ["mcap", "rosbag2"] {
            let complaint = refusal(&["import", format, input, "-o", &output]);
            assert!(complaint.contains(name), "{complaint}");
        }
        assert!(!Path::new(&output).exists());
    }
    for format in ["mcap", "rosbag2", "csv", "tum"] {
        for input in [files.path("missing"), files.path("foreign.mcap")] {
            refusal(&["export", format, &input, "-o", &files.path("nothing")]);
        }
    }
}
