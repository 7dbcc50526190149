//! The commands that a newcomer needs: check, accept, settings, and the noise.

use std::path::Path;

use agv_core::geometry::Pose;
use agv_host_sim::log;
use agv_host_sim::mapping::{Clustering, map_features};
use agv_host_sim::recording::{RecordedEvent, Recording};
use agv_host_sim::replay::replay;
use agv_host_sim::simulate::scenario::{Scenario, WorldOptions};
use agv_host_sim::simulate::simulate;
use agv_lab::evaluate::carpark;
use agv_tests::recordings;

use crate::support::{Files, agv, refusal, text};

const HALL: &str = include_str!("../../host-sim/scenarios/warehouse_hall.toml");
const STORAGE: &str = include_str!("../../host-sim/scenarios/block_storage_mapping.toml");

/// The hall's drive with what the localiser answered.
fn hall(files: &Files) -> String {
    let recording = simulate(&Scenario::parse(HALL).unwrap()).unwrap().recording;
    let answers = replay(&recording, |_| ()).unwrap();
    let path = files.path("hall.agvlog");
    log::write_with_outputs(Path::new(&path), &recording, |event| answers.output(event)).unwrap();
    path
}

fn json(arguments: &[&str]) -> (Option<i32>, serde_json::Value) {
    let output = agv(arguments);
    let value = serde_json::from_slice(&output.stdout);
    (output.status.code(), value.unwrap_or_else(|_| panic!("{arguments:?}: {}", text(&output.stderr))))
}

fn verdict<'a>(result: &'a serde_json::Value, what: &str) -> &'a str {
    let lines = result["lines"].as_array().unwrap();
    let line = lines.iter().find(|line| line["what"].as_str().unwrap().starts_with(what));
    line.unwrap_or_else(|| panic!("no {what}"))["verdict"].as_str().unwrap()
}

/// The drive of a seed in the hall, with the map of features that another drive has made there.
fn mapped(files: &Files, seed: u64) -> String {
    let mut scenario = Scenario::parse(HALL).unwrap();
    let WorldOptions::WarehouseHall(hall) = &mut scenario.world else { panic!() };
    hall.seed = Some(seed);
    scenario.seed = seed + 1;
    let mut mapping = simulate(&scenario).unwrap().recording;
    scenario.seed = seed;
    let mut recording = simulate(&scenario).unwrap().recording;
    // One survey for both.
    mapping.landmarks.clone_from(&recording.landmarks);
    recording.landmarks.extend(map_features(&mapping, &Clustering::default()).unwrap());
    let path = files.path(&format!("{seed}.agvlog"));
    log::write(Path::new(&path), &recording).unwrap();
    path
}

/// Finds the noise, and holds it against the half of the drive that had no part in it; gives the log with it.
fn measured(files: &Files, log: &str, kinds: &[&str]) -> (String, serde_json::Value) {
    let measured = files.path("measured.agvlog");
    let (code, noise) = json(&["calibrate", "noise", log, "--output", &measured, "--json"]);
    assert_eq!(code, Some(0));
    let sources = noise["sources"].as_array().unwrap();
    let names: Vec<&str> = sources.iter().map(|source| source["source"].as_str().unwrap()).collect();
    assert_eq!(names, kinds);
    for source in sources {
        let check = source["check"]["mean"].as_f64().unwrap();
        assert!((1.5..=2.5).contains(&check) && source["good"] == true, "{log}: {noise}");
    }
    (measured, noise)
}

#[test]
fn noise_that_is_measured_makes_the_filter_honest() {
    let files = Files::new();
    let seeds: &[u64] = if std::env::var_os("AGV_LONG").is_some() { &[1, 2, 100_000, 100_010, 100_020] } else { &[1] };
    for seed in seeds {
        let (measured, noise) = measured(&files, &mapped(&files, *seed), &["reflectors", "corners", "end points"]);
        println!("seed {seed}: {noise}");
        // What the sensor is told to do is what it does in the scenario: 8 mm and 0.05 deg.
        let value = |name: &str| {
            let settings = noise["settings"].as_array().unwrap();
            settings.iter().find(|setting| setting["name"] == name).unwrap()["after"].as_f64().unwrap()
        };
        let (range, bearing) = (value("reflectors.range_deviation"), value("reflectors.bearing_deviation"));
        assert!((0.007..0.009).contains(&range), "{range}");
        assert!((0.04..0.06).contains(&bearing.to_degrees()), "{bearing}");
        let ten = format!("along_mm,across_mm,heading_deg\n{}", "1,2,0.01\n".repeat(10));
        let halts = files.write("halts.csv", ten.as_bytes());
        let (code, result) = json(&["accept", &measured, "--halts", &halts, "--json"]);
        // A simulated log holds no outputs of a vehicle: those of the replay are no witness.
        assert_eq!((code, verdict(&result, "the same bits")), (Some(4), "not_measured"), "{result}");
        // Nobody has surveyed marks in it.
        assert_eq!(verdict(&result, "where it says that it is"), "not_measured", "{result}");
        let is_open = |line: &&serde_json::Value| {
            ["the same bits", "where it says that it is"].map(|open| line["what"] == open).contains(&true)
        };
        let others = result["lines"].as_array().unwrap().iter().filter(|line| !is_open(line));
        assert!(others.into_iter().all(|line| line["verdict"] == "pass"), "{result}");
    }
}

#[test]
fn noise_of_reflectors_alone_is_that_of_the_sensor() {
    let files = Files::new();
    measured(&files, &hall(&files), &["reflectors"]);
}

#[test]
fn a_vehicle_that_drives_straight_on_is_not_fit_to_travel_though_its_noise_is_measured() {
    let files = Files::new();
    let mut scenario = Scenario::parse(HALL).unwrap();
    scenario.laser.scans = false;
    let drive = files.path("drive.agvlog");
    log::write(Path::new(&drive), &simulate(&scenario).unwrap().recording).unwrap();
    let (measured, _) = measured(&files, &drive, &["reflectors"]);
    let log = files.path("vehicle.agvlog");
    let (mut recording, _) = log::read(Path::new(&measured)).unwrap();
    for event in &mut recording.events {
        if let RecordedEvent::SetPose(fix) = event {
            (fix.position_deviation, fix.heading_deviation) = (0.05, 0.01);
        }
    }
    agv_tests::busy_board::drive(&recording, 10, Path::new(&log));
    let ten = format!("along_mm,across_mm,heading_deg\n{}", "1,2,0.01\n".repeat(10));
    let halts = files.write("halts.csv", ten.as_bytes());
    let (code, result) = json(&["accept", &log, "--halts", &halts, "--json"]);
    assert_eq!(verdict(&result, "the same bits"), "pass", "{result}");
    // Halts that are repeatable, all at one place: the place itself is not measured.
    assert_eq!(verdict(&result, "where it says that it is"), "not_measured", "{result}");
    // It was told its pose to 5 cm and drives straight on: before it turns, a pose that is off looks like a laser that hangs elsewhere, and the
    // level stays as wide as that. So it is not fit to travel.
    assert_eq!((code, verdict(&result, "fit to travel")), (Some(3), "fail"), "{result}");
    // Settings that the vehicle did not have: its outputs are no witness.
    let other = ["accept", &log, "--halts", &halts, "--set", "odometry.slip=0.004", "--json"];
    let (code, result) = json(&other);
    assert_eq!(verdict(&result, "the same bits"), "not_measured", "{result}");
    assert_eq!(code, Some(3), "{result}");
}

#[test]
fn noise_in_the_car_park_is_measured() {
    let Some(folder) = recordings("noise_in_the_car_park_is_measured", "carpark") else { return };
    let (_, recording, _) = carpark::run(&folder, carpark::Noise::Nominal, carpark::Knowledge::Map).unwrap();
    let files = Files::new();
    let log = files.path("carpark.agvlog");
    log::write(Path::new(&log), &recording).unwrap();
    let (_, noise) = measured(&files, &log, &["reflectors"]);
    println!("{noise}");
}

#[test]
fn an_acceptance_tells_what_was_not_measured_by_its_code() {
    let files = Files::new();
    let log = hall(&files);
    let (code, result) = json(&["accept", &log, "--json"]);
    assert_eq!((verdict(&result, "the same bits"), verdict(&result, "repeatable")), ("not_measured", "not_measured"));
    let is_failed = result["lines"].as_array().unwrap().iter().any(|line| line["verdict"] == "fail");
    assert_eq!(code, Some(if is_failed { 3 } else { 4 }));
    let halts = |reading: &str| format!("along_mm,across_mm,heading_deg\n{}", format!("{reading}\n").repeat(10));
    let file = files.write("halts.csv", halts("1,2,0.01").as_bytes());
    let (_, result) = json(&["accept", &log, "--halts", &file, "--json"]);
    assert_eq!(verdict(&result, "repeatable"), "pass");
    let bad = files.write("bad.csv", b"along_mm,across_mm,heading_deg\n1,2\n");
    assert!(refusal(&["accept", &log, "--halts", &bad]).contains("bad.csv:2:"));
}

/// Where a simulated vehicle really stood for more than two seconds, in order.
fn halts_of(recording: &Recording) -> Vec<Pose> {
    let mut halts = Vec::new();
    let mut begin = recording.truth[0];
    let mut last = begin;
    for now in &recording.truth[1..] {
        let way = begin.pose.between(&now.pose);
        if way.x.hypot(way.y) > 1e-4 {
            halts.extend((last.time.since(begin.time) > 2.2).then_some(last.pose));
            begin = *now;
        }
        last = *now;
    }
    halts.extend((last.time.since(begin.time) > 2.2).then_some(last.pose));
    halts
}

/// A drive with halts through the block storage, each so long, s.
fn halting(halt: f64) -> Recording {
    let mut scenario = Scenario::parse(STORAGE).unwrap();
    let drive = &mut scenario.drive;
    (drive.start_standstill, drive.stop_between_legs, drive.end_standstill) = (3.0, halt, 3.0);
    scenario.laser.scans = false;
    simulate(&scenario).unwrap().recording
}

/// A table of surveyed marks, `shift` metres along x from where they are: the vehicle halts beside each, as a ruler tells.
fn marks_beside(halts: &[Pose], shift: f64) -> String {
    let by_ruler = Pose::new(0.012, -0.005, 0.1_f64.to_radians());
    let lines = halts.iter().zip('A'..).map(|(halt, name)| {
        let Pose { x, y, theta } = halt.compose(&by_ruler.between(&Pose::default()));
        format!("{name},{},{y},{},12,-5,0.1\n", x + shift, theta.to_degrees())
    });
    format!("mark,x_m,y_m,heading_deg,along_mm,across_mm,turned_deg\n{}", lines.collect::<String>())
}

#[test]
fn a_vehicle_that_passes_every_line_is_accepted() {
    let files = Files::new();
    let drive = files.path("drive.agvlog");
    // The two seconds before it is told where it is are less than a hundredth of the drive.
    let recording = halting(60.0);
    log::write(Path::new(&drive), &recording).unwrap();
    let (measured, _) = measured(&files, &drive, &["reflectors"]);
    let log = files.path("vehicle.agvlog");
    let seconds = recording.truth.last().unwrap().time.since(recording.truth[0].time) as u64;
    agv_tests::busy_board::drive(&log::read(Path::new(&measured)).unwrap().0, seconds, Path::new(&log));
    let marks = files.write("marks.csv", marks_beside(&halts_of(&recording), 0.0).as_bytes());
    let ten = format!("along_mm,across_mm,heading_deg\n{}", "1,2,0.01\n".repeat(10));
    let halts = files.write("halts.csv", ten.as_bytes());
    let (code, result) = json(&["accept", &log, "--halts", &halts, "--marks", &marks, "--json"]);
    assert_eq!((code, &result["verdict"]), (Some(0), &"pass".into()), "{result}");
}

#[test]
fn halts_at_surveyed_marks_tell_a_map_that_is_elsewhere() {
    let files = Files::new();
    let recording = halting(4.0);
    let log = files.path("drive.agvlog");
    log::write(Path::new(&log), &recording).unwrap();
    let halts = halts_of(&recording);
    assert!(halts.len() >= 4, "{halts:?}");
    let judge = |shift: f64, left_out: usize| {
        let marks = files.write("marks.csv", marks_beside(&halts[left_out..], shift).as_bytes());
        json(&["accept", &log, "--marks", &marks, "--json"]).1
    };
    let line = "where it says that it is";
    let result = judge(0.0, 0);
    assert_eq!(verdict(&result, line), "pass", "{result}");
    // A survey that is elsewhere than the map, however repeatable the halts are.
    let result = judge(0.05, 0);
    assert_eq!(verdict(&result, line), "fail", "{result}");
    let result = judge(0.0, halts.len() - 2);
    assert_eq!(verdict(&result, line), "not_measured", "{result}");
}

#[test]
fn a_check_names_what_was_planted() {
    let files = Files::new();
    let plan = files.path("plan.toml");
    let made =
        agv(&["calibrate", "plan", "--area", "14x11", "--steering", "18..50", "--time", "200", "--scenario", &plan]);
    assert!(made.status.success(), "{}", text(&made.stderr));
    let plan = std::fs::read_to_string(&plan).unwrap();
    for (mistake, named) in [
        ("drive_reversed", "drive counter counts the wrong way"),
        ("steering_reversed", "steering counter counts the wrong way"),
        ("encoders_swapped", "encoders are exchanged"),
    ] {
        let mut scenario = Scenario::parse(&plan).unwrap();
        let truth = &mut scenario.vehicle.truth;
        match mistake {
            "drive_reversed" => truth.drive_reversed = true,
            "steering_reversed" => truth.steering_reversed = true,
            _ => truth.encoders_swapped = true,
        }
        scenario.laser.scans = false;
        let recording = simulate(&scenario).unwrap().recording;
        let log = files.path(&format!("{mistake}.agvlog"));
        log::write(Path::new(&log), &recording).unwrap();
        let (code, result) = json(&["check", &log, "--json"]);
        assert_eq!(code, Some(0));
        let what: String = result["findings"].to_string();
        assert!(what.contains(named), "{mistake}: {what}");
        let complaint = refusal(&["calibrate", &log]);
        assert!(complaint.contains(named), "{complaint}");
        if mistake == "encoders_swapped" {
            continue;
        }
        // What is mended stays mended: the file carries the sign.
        assert!(complaint.contains("--mend"), "{complaint}");
        let vehicle = files.path("vehicle.toml");
        let mended = agv(&["calibrate", &log, "--mend", "--apply", &vehicle]);
        assert!(mended.status.success(), "{}", text(&mended.stderr));
        let (_, replayed) = json(&["replay", &log, "--vehicle", &vehicle, "--json"]);
        let lost = replayed["modes"].as_array().unwrap().iter().any(|mode| mode["mode"] == "lost");
        assert!(!lost && replayed["accuracy"]["position_mm"]["p95"].as_f64().unwrap() < 100.0, "{mistake}: {replayed}");
    }
}

#[test]
fn settings_are_listed_and_names_are_suggested() {
    let files = Files::new();
    let (_, all) = json(&["settings", "--json"]);
    for setting in all.as_array().unwrap() {
        assert!(setting["meaning"].as_str().unwrap().len() > 5, "{setting}");
    }
    let (_, one) = json(&["settings", "vehicle.wheelbase", "--json"]);
    assert_eq!((&one[0]["unit"], &one[0]["least"]), (&"m".into(), &0.05.into()));
    assert!(refusal(&["settings", "vehicle.wheelbse"]).contains("did you mean vehicle.wheelbase?"));
    let key = files.write("agv.key", "0".repeat(64).as_bytes());
    let flash = files.path("flash.bin");
    let wrong = ["provision", "--key", &key, "--output", &flash, "--set", "laser.teta=1"];
    assert!(refusal(&wrong).contains("did you mean laser.theta?"));
    let asked = agv(&[
        "provision",
        "--key",
        &key,
        "--output",
        &flash,
        "--set",
        "vehicle.wheelbase=30",
        "--set",
        "laser.theta=3.0",
    ]);
    assert!(asked.status.success());
    let replayed = agv(&["replay", &hall(&files), "--set", "vehicle.wheelbase=30"]);
    assert!(text(&replayed.stderr).contains("vehicle.wheelbase is 30 m"), "{}", text(&replayed.stderr));
    let questions = text(&asked.stderr);
    assert!(questions.contains("vehicle.wheelbase is 30 m") && questions.contains("171.9 deg"), "{questions}");
    let said = text(&asked.stdout);
    assert!(said.contains("vehicle.wheelbase") && said.contains("landmarks") && said.contains("flash.bin"), "{said}");
}

#[test]
fn the_map_of_another_hall_is_refused() {
    let files = Files::new();
    let key = files.write("agv.key", "0".repeat(64).as_bytes());
    let hall = files.write("hall.imk", b"7 -1000 2000 1 2 80 0\n8 5500 -6125 1 2 80 0\n9 0 40 1 2 80 0\n");
    let other = files.write("other.imk", b"7 -1000 2000 1 2 80 0\n8 5500 -6125 1 2 80 0\n9 0 41 1 2 80 0\n");
    let (_, told) = json(&["layout", "identity", &hall, "--json"]);
    let identity = told["map_identity"].as_u64().unwrap();
    assert_eq!(told["landmarks"], 3);
    assert!(text(&agv(&["layout", "identity", &hall]).stdout).contains(&identity.to_string()));
    let (set, flash) = (format!("maps.identity={identity}"), files.path("flash.bin"));
    let (_, written) = json(&["provision", "--key", &key, "--map", &hall, "--set", &set, "--output", &flash, "--json"]);
    assert_eq!(written["map_identity"], identity);
    let before = std::fs::read(&flash).unwrap();
    let refused = refusal(&["provision", "--key", &key, "--map", &other, "--set", &set, "--output", &flash]);
    assert!(refused.contains(&format!("maps.identity is {identity}")), "{refused}");
    assert_eq!(std::fs::read(&flash).unwrap(), before);
}

#[test]
fn the_pages_of_man_are_written() {
    let files = Files::new();
    let output = agv(&["manual", "--output", &files.path("man1")]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    for name in ["agv.1", "agv-replay.1", "agv-nav350-layout-download.1"] {
        let page = std::fs::read_to_string(files.path(&format!("man1/{name}"))).unwrap();
        assert!(page.contains(".TH") && page.contains("SYNOPSIS"), "{name}");
    }
}
