//! The page of `agv view` in a browser: a drive from a log, and one that goes on in emulation.

use std::net::{Ipv4Addr, TcpListener};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use agv_core::geometry::Pose;
use agv_core::integrity::{AlertLimit, AlertLimits};
use agv_core::measurement::{PoseFix, Time};
use agv_host_sim::emulate::vehicle::{self, VehicleOptions};
use agv_host_sim::log;
use agv_host_sim::recording::{RecordedEvent, RecordedOutput, Recording, truth_at};
use agv_host_sim::replay::{Replay, replay};
#[cfg(target_os = "linux")]
use agv_host_sim::run::{Demonstration, Logs, RealTime};
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::simulate;
use agv_host_sim::view::{Shared, Timeline, follow, load, serve};
use agv_tests::{emulator, image, repository, skip};
use serde_json::Value;

/// Where the pictures of the page go.
fn pictures() -> PathBuf {
    let folder = repository("target/report");
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// Whether there are a browser and what drives it; if not, says that the test is skipped.
fn has_browser(test: &str) -> bool {
    let runs = |command: &mut Command| command.output().is_ok_and(|output| output.status.success());
    let has_driver = runs(node().args(["-e", "require('playwright-core')"]));
    let has_chromium = runs(Command::new(chromium()).arg("--version"));
    if !has_driver || !has_chromium {
        skip(test, "chromium, node or its package playwright-core is not there");
    }
    has_driver && has_chromium
}

fn chromium() -> String {
    std::env::var("CHROMIUM").unwrap_or_else(|_| "/usr/bin/chromium".to_owned())
}

fn node() -> Command {
    let mut node = Command::new("node");
    node.env("NODE_PATH", repository("target/node/node_modules"));
    node
}

/// What the browser finds on a page that `feed` fills.
fn browse(
    timeline: Timeline,
    kind: &str,
    pictures: &str,
    feed: impl FnOnce(&Shared, &Arc<AtomicBool>) + Send,
) -> Value {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let url = format!("http://{}/", listener.local_addr().unwrap());
    let shared = Shared::new(timeline);
    let is_stopped = Arc::new(AtomicBool::new(false));
    let output = std::thread::scope(|scope| {
        scope.spawn(|| serve(listener, &shared, &is_stopped).unwrap());
        scope.spawn(|| feed(&shared, &is_stopped));
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/view/browser.js");
        let output = node().arg(script).args([&url, pictures, kind]).output().unwrap();
        is_stopped.store(true, Ordering::Relaxed);
        output
    });
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{complaint}");
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["complaints"], Value::Array(Vec::new()));
    assert_eq!(found["dark"], "rgb(22, 22, 22)");
    for (size, overflow) in found["sizes"].as_object().unwrap() {
        assert_eq!(overflow, &Value::from(0), "{size}");
    }
    found
}

fn hall(change: &str) -> Recording {
    let path = repository("host-sim/scenarios/warehouse_hall.toml");
    let text = std::fs::read_to_string(path).unwrap();
    simulate(&Scenario::parse(&text.replace("speed = 1.2", change)).unwrap()).unwrap().recording
}

/// The hall, with somebody who states a wrong pose after 30 s and the right one after 40 s.
fn misled() -> Recording {
    let mut recording = hall("speed = 1.2");
    for (seconds, error) in [(30.0, 3.0), (40.0, 0.0)] {
        let time = Time::from_seconds(1.0 + seconds);
        let truth = truth_at(&recording.truth, time).unwrap();
        let pose = Pose::new(truth.x + error, truth.y - error, truth.theta + 0.3 * error);
        let place = recording.events.iter().position(|event| event.time().is_some_and(|at| at > time)).unwrap();
        let fix = PoseFix { time, pose, position_deviation: 0.03, heading_deviation: 0.01 };
        recording.events.insert(place, RecordedEvent::SetPose(fix));
    }
    recording
}

/// The pose that was answered last by then.
fn answered(answers: &Replay, seconds: f64) -> Pose {
    let time = Time::from_seconds(seconds);
    answers.poses.iter().rev().find(|pose| pose.time <= time).unwrap().pose
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn assert_shows(state: &Value, answers: &Replay) {
    let expected = answered(answers, number(&state["time_s"]));
    for (name, expected) in [("x_m", expected.x), ("y_m", expected.y), ("heading_rad", expected.theta)] {
        let shown = number(&state["pose"][name]);
        assert!((shown - expected).abs() < 1e-9, "{name} is {shown} instead of {expected} at {}", state["time_s"]);
    }
    // It is drawn there, too.
    assert_eq!(state["drawn"]["vehicle"]["x"], state["pose"]["x_m"]);
    assert!(number(&state["drawn"]["scanPoints"]) > 500.0 && number(&state["drawn"]["pathPoints"]) > 50.0, "{state}");
    let bound = number(&state["level"][0]);
    if matches!(state["mode"].as_str(), Some("lost" | "not_localised")) {
        assert!(state["alarm"] == "no_pose" && state["drawn"]["level"].is_null(), "{state}");
        return;
    }
    assert!(bound > 0.0 && state["drawn"]["level"]["m"] == state["level"][0], "{state}");
    let limits = AlertLimits::default();
    let is_within = |limit: &AlertLimit| bound <= limit.position && number(&state["level"][1]) <= limit.heading;
    let alarm = if is_within(&limits.docking) { "none" } else { "docking" };
    assert_eq!(state["alarm"], if is_within(&limits.travel) { alarm } else { "travel" });
}

#[test]
fn a_log_is_looked_at() {
    if !has_browser("a_log_is_looked_at") {
        return;
    }
    let recording = misled();
    let answers = replay(&recording, |_| ()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let with_answers = folder.path().join("answered.agvlog");
    log::write_with_outputs(&with_answers, &recording, |event| answers.output(event)).unwrap();
    let without = folder.path().join("plain.agvlog");
    log::write(&without, &recording).unwrap();
    // A log without answers is replayed, and shows the same.
    for path in [with_answers, without] {
        let pictures = pictures();
        let found = browse(Timeline::of_log(path.clone()), "log", pictures.to_str().unwrap(), |shared, is_stopped| {
            load(&path, shared, is_stopped).unwrap();
        });
        let found_by_log = &found["found"];
        for state in found_by_log["seeks"].as_array().unwrap() {
            assert_shows(state, &answers);
        }
        for name in ["dragged", "next_event", "after_play"] {
            assert_shows(&found_by_log[name], &answers);
        }
        assert_shows(&found["phone"], &answers);
        // The slider was drawn to six tenths of its length, give or take its knob.
        let dragged = number(&found_by_log["dragged"]["time_s"]);
        let [start, end] = ["start_s", "end_s"].map(|name| number(&found_by_log["dragged"][name]));
        assert!(((dragged - start) / (end - start) - 0.6).abs() < 0.02, "{dragged} of {start} to {end}");
        // It was lost after the wrong pose, found itself with the right one, and that was a large correction or a given pose.
        let kinds = &found_by_log["kinds"];
        let time_of = |kind: &str| number(&kinds[kind]["first"]["time_s"]);
        let lost = number(&kinds["lost"]["jumped"]["time_s"]);
        assert!(lost > 31.0 && lost < 41.0 && lost == time_of("lost"), "{kinds}");
        assert_eq!(kinds["lost"]["jumped"]["mode"], "lost");
        assert_shows(&kinds["lost"]["jumped"], &answers);
        let relocalised = found_by_log["kinds"]["relocalised"]["count"].as_u64().unwrap();
        assert_eq!(relocalised, 2, "{kinds}");
        let played = number(&found_by_log["after_play"]["time_s"]) - number(&found_by_log["before_play"]["time_s"]);
        assert!((5.0..60.0).contains(&played), "{played}");
        assert_eq!(found_by_log["after_keys"]["following"], false);
    }
}

#[test]
fn an_hour_is_opened_and_scrubbed() {
    if std::env::var_os("AGV_LONG").is_none() || !has_browser("an_hour_is_opened_and_scrubbed") {
        return;
    }
    let recording = hall("speed = 0.0249");
    let answers = replay(&recording, |_| ()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hour.agvlog");
    log::write_with_outputs(&path, &recording, |event| answers.output(event)).unwrap();
    let mut loaded = 0.0;
    let found = browse(Timeline::of_log(path.clone()), "log", "-", |shared, is_stopped| {
        let start = Instant::now();
        load(&path, shared, is_stopped).unwrap();
        loaded = start.elapsed().as_secs_f64();
    });
    let seeks: Vec<f64> =
        found["found"]["seeks"].as_array().unwrap().iter().map(|state| number(&state["seek_ms"])).collect();
    println!("scans {}, loaded in {loaded:.2} s, opened in {} ms, seeks in {seeks:?} ms", 28_800, found["opened_ms"]);
    assert!(loaded < 2.0 && seeks.iter().all(|seek| *seek < 100.0));
}

#[test]
fn a_drive_in_emulation_is_looked_at() {
    let test = "a_drive_in_emulation_is_looked_at";
    let Some(image) = image(test, "an500", "vehicle").filter(|_| emulator(test) && has_browser(test)) else { return };
    let recording = hall("speed = 1.2");
    let folder = tempfile::tempdir().unwrap();
    let image = image.canonicalize().unwrap();
    let options = VehicleOptions::new(&image, folder.path());
    let copy = folder.path().join("copy.agvlog");
    let mut found = Value::Null;
    let driven = vehicle::drive(&recording, &options, 45.0, |watch| {
        let host = format!("127.0.0.1:{}", watch.stream_port);
        let pictures = pictures();
        found = browse(Timeline::of_controller(&host), "live", pictures.to_str().unwrap(), |shared, is_stopped| {
            follow(&host, Some(&copy), shared, is_stopped, |_| ()).unwrap();
        });
    })
    .unwrap();
    // What the page showed is what the firmware said at that time, which is in its log. While it drives, the page may show
    // what will be corrected at once, or what was true when the laser was ahead of the encoders.
    let contents = log::read_contents(&driven.log, |_| ()).unwrap();
    for name in ["first", "second", "scrubbed", "again"] {
        let state = &found["found"][name];
        let time = number(&state["shown_s"]);
        let shown = ["time_s", "x_m", "y_m", "heading_rad"].map(|name| number(&state["pose"][name]));
        assert!((0.0..0.5).contains(&(time - shown[0])), "{name}: {time} {shown:?}");
        let is_shown = |output: &RecordedOutput| {
            let pose = &output.pose;
            let said = [pose.time.seconds(), pose.pose.x, pose.pose.y, pose.pose.theta];
            shown.iter().zip(said).all(|(shown, said)| (shown - said).abs() < 1e-9)
        };
        assert!(contents.outputs.iter().any(is_shown), "{name}: {shown:?}");
        if name == "scrubbed" {
            let time = Time::from_seconds(time);
            let last = contents.outputs.iter().rev().find(|output| output.pose.time <= time);
            assert!(last.is_some_and(is_shown), "{shown:?} {last:?}");
        }
    }
    assert_eq!(found["found"]["again"]["live"], true);
    assert!(log::read_contents(&copy, |_| ()).unwrap().outputs.len() > 100);
}

/// The demonstration of `agv run`: the page shows a vehicle that moves.
#[cfg(target_os = "linux")]
#[test]
fn a_demonstration_is_looked_at() {
    if !has_browser("a_demonstration_is_looked_at") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let is_stopped = Arc::new(AtomicBool::new(false));
    let pictures = pictures().join("run");
    std::fs::create_dir_all(&pictures).unwrap();
    let mut found = Value::Null;
    let demonstration = Demonstration::new().unwrap();
    let remark = |text: &str| println!("{text}");
    let summary =
        demonstration.run(folder.path(), RealTime::default(), Logs::default(), &is_stopped, &remark, |running| {
            let host = running.log.to_string();
            let look = || {
                browse(Timeline::of_controller(&host), "live", pictures.to_str().unwrap(), |shared, is_over| {
                    follow(&host, None, shared, is_over, |_| ()).unwrap();
                })
            };
            // Whatever it shows, the demonstration ends.
            let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(look));
            is_stopped.store(true, Ordering::Relaxed);
            found = outcome.unwrap_or_default();
        });
    let summary = summary.unwrap();
    assert!(summary.was_localised, "{summary:?}");
    let place = |name: &str| ["x_m", "y_m"].map(|axis| number(&found["found"][name]["pose"][axis]));
    let ([first_x, first_y], [second_x, second_y]) = (place("first"), place("second"));
    assert!((first_x - second_x).hypot(first_y - second_y) > 0.05, "{found}");
}

/// What people are given as files: drives, layouts, calibrations.
#[test]
fn every_page_is_read_light_dark_and_on_a_phone() {
    let name = "every_page_is_read_light_dark_and_on_a_phone";
    let Some(agv) = agv_tests::agv(name).filter(|_| has_browser(name)) else { return };
    let files = tempfile::tempdir().unwrap();
    let path = |name: &str| files.path().join(name).to_str().unwrap().to_owned();
    let run = |arguments: &[&str]| {
        let run = Command::new(&agv).args(arguments).current_dir(files.path()).output().unwrap();
        assert!(run.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&run.stderr));
    };
    run(&["simulate", "block_storage_p1", "--output", "drive.agvlog"]);
    run(&["report", "drive.agvlog", "--output", "drive.html"]);
    run(&["report", "drive.agvlog", "drive.agvlog", "--output", "comparison.html"]);
    std::fs::write(path("hall.imk"), "1 0 0 1 2 80 0\n2 12000 0 1 2 80 0\n3 12000 9000 1 2 80 0\n4 0 8000 1 2 80 0\n")
        .unwrap();
    run(&["layout", "check", "hall.imk", "--report", "layout"]);
    std::fs::rename(path("layout/index.html"), path("layout.html")).unwrap();
    run(&["calibrate", "plan", "--area", "14x11", "--steering", "18..50", "--time", "200", "--scenario", "plan.toml"]);
    run(&["simulate", "plan.toml", "--output", "plan.agvlog"]);
    run(&["calibrate", "plan.agvlog", "--report", "calibration"]);
    std::fs::rename(path("calibration/index.html"), path("calibration.html")).unwrap();
    let pages = ["drive.html", "comparison.html", "layout.html", "calibration.html"];
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/view/pages.js");
    let output = node().arg(script).arg(pictures()).args(pages.map(path)).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found.as_object().unwrap().len(), pages.len());
    for (page, found) in found.as_object().unwrap() {
        assert_eq!(found["complaints"], Value::Array(Vec::new()), "{page}");
        for (look, is_dark) in [("light", false), ("dark", true), ("phone", false)] {
            let seen = &found[look];
            assert_eq!(seen["overflow"], 0, "{page}, {look}");
            assert_eq!(number(&seen["paper"]) < number(&seen["ink"]), is_dark, "{page}, {look}: {seen}");
        }
    }
}
