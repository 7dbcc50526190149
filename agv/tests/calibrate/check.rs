//! What `agv check` says of drives in which a mistake is planted, and whether the command that it gives mends them.

use std::path::Path;
use std::process::{Command, Output};

use agv_host_sim::log;
use agv_host_sim::recording::{RecordedEvent, Recording};
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::simulate;

use crate::support::{Files, agv, text};

const HALL: &str = include_str!("../../../host-sim/scenarios/warehouse_hall.toml");

/// A mistake in a drive.
struct Planted {
    name: &'static str,
    /// What is wrong with the vehicle.
    vehicle: fn(&mut Scenario),
    /// What is wrong with what was recorded.
    recording: fn(&mut Recording),
    /// What a finding must say, and no other finding may be there.
    named: &'static [&'static str],
}

const NONE: Planted = Planted { name: "none", vehicle: |_| (), recording: |_| (), named: &[] };

/// Mistakes of the vehicle that one command mends.
const VEHICLES: [Planted; 13] = [
    Planted {
        name: "drive reversed",
        vehicle: |scenario| scenario.vehicle.truth.drive_reversed = true,
        named: &["the drive counter counts the wrong way"],
        ..NONE
    },
    Planted {
        name: "steering reversed",
        vehicle: |scenario| scenario.vehicle.truth.steering_reversed = true,
        named: &["the steering counter counts the wrong way"],
        ..NONE
    },
    Planted {
        name: "both reversed",
        vehicle: |scenario| {
            let truth = &mut scenario.vehicle.truth;
            (truth.drive_reversed, truth.steering_reversed) = (true, true);
        },
        named: &["the drive counter counts the wrong way", "the steering counter counts the wrong way"],
        ..NONE
    },
    Planted {
        name: "offset of 90 deg",
        vehicle: |scenario| scenario.vehicle.truth.steering_offset_error_deg = 90.0,
        named: &["the steering offset is off by 90 deg"],
        ..NONE
    },
    Planted {
        name: "offset of -90 deg",
        vehicle: |scenario| scenario.vehicle.truth.steering_offset_error_deg = -90.0,
        named: &["the steering offset is off by -90 deg"],
        ..NONE
    },
    Planted {
        name: "wheelbase 2 % too long",
        vehicle: |scenario| scenario.vehicle.truth.wheelbase_error = -0.03,
        named: &["the wheelbase is 1.4"],
        ..NONE
    },
    Planted {
        name: "wheelbase 10 mm too short",
        vehicle: |scenario| scenario.vehicle.truth.wheelbase_error = 0.01,
        named: &["the wheelbase is 1.51"],
        ..NONE
    },
    Planted {
        name: "wheelbase 10 % too short",
        vehicle: |scenario| scenario.vehicle.truth.wheelbase_error = 0.15,
        named: &["the wheelbase is 1.6"],
        ..NONE
    },
    Planted {
        name: "yaw of 3 deg",
        vehicle: |scenario| scenario.vehicle.truth.laser_error.heading_deg = 3.0,
        named: &["the laser is turned by 3.0 deg"],
        ..NONE
    },
    Planted {
        name: "yaw of 90 deg",
        vehicle: |scenario| scenario.vehicle.truth.laser_error.heading_deg = 90.0,
        named: &["the laser is turned by 90.0 deg"],
        ..NONE
    },
    Planted {
        name: "yaw of 180 deg",
        vehicle: |scenario| scenario.vehicle.truth.laser_error.heading_deg = 180.0,
        named: &["the laser is turned by"],
        ..NONE
    },
    Planted {
        name: "mounting",
        vehicle: |scenario| {
            let laser = &mut scenario.vehicle.truth.laser_error;
            (laser.x, laser.y) = (0.2, -0.15);
        },
        named: &["the laser is 200 mm further ahead and -15"],
        ..NONE
    },
    Planted {
        name: "yaw and wheelbase",
        vehicle: |scenario| {
            scenario.vehicle.truth.laser_error.heading_deg = -10.0;
            scenario.vehicle.truth.wheelbase_error = 0.045;
        },
        named: &["the laser is turned by -10.0 deg", "the wheelbase is 1.54"],
        ..NONE
    },
];

fn plan(files: &Files) -> String {
    let plan = files.path("plan.toml");
    let arguments = ["calibrate", "plan", "--area", "14x11", "--steering", "18..50", "--time", "200", "--scenario"];
    let made = agv(&[&arguments[..], &[&plan]].concat());
    assert!(made.status.success(), "{}", text(&made.stderr));
    std::fs::read_to_string(plan).unwrap()
}

/// A drive with a mistake, as a log beside which commands run.
fn drive(files: &Files, scenario: &str, planted: &Planted) -> String {
    let mut scenario = Scenario::parse(scenario).unwrap();
    let truth = &mut scenario.vehicle.truth;
    truth.random_signs = false;
    (truth.steering_offset_error_deg, truth.laser_error) = (0.05, Default::default());
    scenario.laser.scans = false;
    (planted.vehicle)(&mut scenario);
    let mut recording = simulate(&scenario).unwrap().recording;
    (planted.recording)(&mut recording);
    let name = format!("{}.agvlog", planted.name.replace(' ', "_"));
    log::write(Path::new(&files.path(&name)), &recording).unwrap();
    name
}

pub fn run(files: &Files, command: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_agv")).args(command).current_dir(files.folder()).output().unwrap()
}

pub fn json(files: &Files, command: &[&str]) -> serde_json::Value {
    let output = run(files, command);
    assert!(output.status.success(), "{command:?}: {}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// What `agv check` finds: what it is, and what to do.
fn findings(files: &Files, log: &str) -> Vec<[String; 2]> {
    let result = json(files, &["check", log, "--json"]);
    let word = |finding: &serde_json::Value, key: &str| finding[key].as_str().unwrap().to_owned();
    result["findings"].as_array().unwrap().iter().map(|one| [word(one, "what"), word(one, "next")]).collect()
}

/// The one finding of what was planted.
fn finding(files: &Files, log: &str, planted: &Planted) -> [String; 2] {
    let found = findings(files, log);
    let [one] = &found[..] else { panic!("{}: {found:?}", planted.name) };
    assert!(planted.named.iter().all(|words| one[0].contains(words)), "{}: {one:?}", planted.name);
    one.clone()
}

/// Runs the command that a finding gives.
fn follow(files: &Files, next: &str) {
    let words: Vec<&str> = next.split_whitespace().collect();
    assert_eq!(words[0], "agv", "{next}");
    let output = run(files, &words[1..]);
    assert!(output.status.success(), "{next}: {}", text(&output.stderr));
}

/// 95 per cent of the drive are nearer than this to the truth, mm; infinite if it is ever lost.
pub fn replayed(files: &Files, command: &[&str]) -> f64 {
    let result = json(files, &[&["replay"], command, &["--json"]].concat());
    let is_lost = result["modes"].as_array().unwrap().iter().any(|mode| mode["mode"] == "lost");
    if is_lost { f64::INFINITY } else { result["accuracy"]["position_mm"]["p95"].as_f64().unwrap() }
}

/// What a sound drive ends with, mm.
pub const GOOD: f64 = 20.0;

fn assert_vehicle_is_mended(files: &Files, scenario: &str, planted: &Planted) {
    let log = drive(files, scenario, planted);
    let [_, next] = finding(files, &log, planted);
    follow(files, &next);
    let after = replayed(files, &[&log, "--vehicle", "vehicle.toml"]);
    assert!(after < GOOD, "{}: {after} mm", planted.name);
}

#[test]
fn mistakes_are_named_and_mended_in_a_drive_for_calibration() {
    let files = Files::new();
    let plan = plan(&files);
    for planted in &VEHICLES {
        assert_vehicle_is_mended(&files, &plan, planted);
    }
}

#[test]
fn mistakes_are_named_and_mended_in_a_day_s_drive() {
    let files = Files::new();
    // A drive that goes from stop to stop tells a hundredth of the wheelbase, a day's drive only two.
    for planted in VEHICLES.iter().filter(|planted| planted.name != "wheelbase 10 mm too short") {
        assert_vehicle_is_mended(&files, HALL, planted);
    }
}

#[test]
fn what_no_parameter_mends_is_named() {
    let files = Files::new();
    let mistakes = [
        Planted {
            name: "exchanged",
            vehicle: |scenario| scenario.vehicle.truth.encoders_swapped = true,
            named: &["the two encoders are exchanged", "can.drive_node and can.steering_node"],
            ..NONE
        },
        Planted {
            name: "offset of 180 deg",
            vehicle: |scenario| scenario.vehicle.truth.steering_offset_error_deg = 180.0,
            named: &["the steering offset is off by 180 deg", "object 6003h"],
            ..NONE
        },
    ];
    for scenario in [&plan(&files), HALL] {
        for planted in &mistakes {
            let log = drive(&files, scenario, planted);
            let found = findings(&files, &log);
            let [[what, next]] = &found[..] else { panic!("{}: {found:?}", planted.name) };
            assert_eq!(what, planted.named[0]);
            assert!(next.contains(planted.named[1]), "{next}");
            // Nobody pretends that a parameter mends it.
            let output = run(&files, &["calibrate", &log, "--mend", "--apply", "never.toml"]);
            assert_eq!(output.status.code(), Some(1));
            let complaint = text(&output.stderr);
            assert!(complaint.contains(planted.named[0]) && !complaint.contains("--mend"), "{complaint}");
            assert!(!Path::new(&files.path("never.toml")).exists());
        }
    }
}

/// The laser's times as if its clock were ahead.
fn late(recording: &mut Recording, seconds: f64) {
    for event in &mut recording.events {
        if let RecordedEvent::Reflectors(seen) = event {
            seen.observations.iter_mut().for_each(|one| one.time = one.time.offset(seconds));
        }
    }
}

#[test]
fn a_wrong_clock_is_named_and_put_right() {
    let files = Files::new();
    let clocks = [
        Planted { name: "late", recording: |drive| late(drive, 0.06), named: &["are 60 ms too late"], ..NONE },
        Planted { name: "early", recording: |drive| late(drive, -0.04), named: &["are 40 ms too early"], ..NONE },
        Planted { name: "far", recording: |drive| late(drive, 0.15), named: &["are 150 ms too late"], ..NONE },
    ];
    for scenario in [&plan(&files), HALL] {
        for planted in &clocks {
            let log = drive(&files, scenario, planted);
            let found = findings(&files, &log);
            let [[what, next]] = &found[..] else { panic!("{}: {found:?}", planted.name) };
            let stated: f64 = what.split_whitespace().find_map(|word| word.parse().ok()).unwrap();
            let true_late: f64 = planted.named[0].split_whitespace().find_map(|word| word.parse().ok()).unwrap();
            assert!((stated - true_late).abs() < 5.0, "{}: {what}", planted.name);
            assert_eq!(what.contains("late"), planted.named[0].contains("late"), "{what}");
            follow(&files, &next[next.find("agv").unwrap()..]);
            assert!(replayed(&files, &["mended.agvlog"]) < GOOD, "{}", planted.name);
            // What is right stays as it is.
            let again = run(&files, &["check", "mended.agvlog", "--put-right", "again.agvlog"]);
            assert_eq!(again.status.code(), Some(1), "{}", text(&again.stdout));
        }
    }
}

#[test]
fn noise_and_the_map_of_another_place_are_named() {
    let files = Files::new();
    let noises = [
        Planted {
            name: "too little noise is told",
            recording: |drive| drive.parameters.reflectors.range_deviation = 2e-3,
            named: &["innovations are not what the filter expects"],
            ..NONE
        },
        Planted {
            name: "too much noise is told",
            recording: |drive| drive.parameters.reflectors.range_deviation = 5e-2,
            named: &["innovations are not what the filter expects"],
            ..NONE
        },
    ];
    for planted in &noises {
        let log = drive(&files, HALL, planted);
        let [_, next] = finding(&files, &log, planted);
        follow(&files, &format!("{next} --output measured.agvlog"));
        // What was mended is not complained of again.
        assert_eq!(findings(&files, "measured.agvlog"), Vec::<[String; 2]>::new(), "{}", planted.name);
    }
    let mut elsewhere = Planted {
        name: "elsewhere",
        vehicle: |scenario| scenario.laser.scans = true,
        recording: |drive| {
            let mut scenario = Scenario::parse(HALL).unwrap();
            (scenario.seed, scenario.laser.scans) = (7, false);
            drive.landmarks = simulate(&scenario).unwrap().recording.landmarks;
        },
        named: &["map of another place"],
    };
    let log = drive(&files, HALL, &elsewhere);
    let told = |log: &str| findings(&files, log).into_iter().find(|[what, _]| what.contains("map of another place"));
    let [_, next] = told(&log).unwrap();
    let [map, again] = &next.split(", then ").collect::<Vec<_>>()[..] else { panic!("{next}") };
    follow(&files, map);
    follow(&files, &format!("{again} --output again.agvlog"));
    assert_eq!(told("again.agvlog"), None);
    // The map hangs at the start that the vehicle was told, which is a little off.
    let off = replayed(&files, &["again.agvlog"]);
    assert!(off < GOOD, "{off}");
    // No map can be made without scans.
    (elsewhere.name, elsewhere.vehicle) = ("elsewhere without scans", NONE.vehicle);
    let [_, next] = told(&drive(&files, HALL, &elsewhere)).unwrap();
    assert!(!next.contains("--slam") && next.contains("recorded with scans"), "{next}");
}

#[test]
fn a_start_that_nobody_told_is_found_where_the_log_can() {
    let files = Files::new();
    let untold = |name, recording: fn(&mut Recording)| {
        let log = drive(&files, HALL, &Planted { name, recording, ..NONE });
        let found = findings(&files, &log);
        let told = found.iter().find(|[what, _]| what.contains("where it starts"));
        told.unwrap_or_else(|| panic!("{found:?}"))[1].clone()
    };
    let next = untold("untold", |drive| drive.events.retain(|event| !matches!(event, RecordedEvent::SetPose(_))));
    assert!(next.contains("--relocalise reflectors, or --start recorded"), "{next}");
    let next = untold("untold, no map", |drive| {
        drive.events.retain(|event| !matches!(event, RecordedEvent::SetPose(_)));
        drive.landmarks.clear();
        drive.truth.clear();
    });
    assert!(
        !next.contains("relocalise") && !next.contains("recorded") && next.contains("--start X,Y,HEADING"),
        "{next}"
    );
}
