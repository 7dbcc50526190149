//! Sixty mistakes planted in drives of three vehicles by what each may be localised by, singly and in pairs: `agv check` names the true one
//! among at most two, never a wrong one alone, and the command that it gives leaves a sound drive.
//!
//! Every sixth case of the tricycle, and all sixty where `AGV_LONG` is set.

use std::path::Path;

use agv_core::geometry::wrap;
use agv_core::odometry::{Counted, Vehicle};
use agv_host_sim::calibrate::wheeled::fitted_vehicle::with_counter_scale;
use agv_host_sim::drive::{Figures, Track};
use agv_host_sim::drive_check::{Finding, check};
use agv_host_sim::log;
use agv_host_sim::mapping::{Clustering, map_features_at};
use agv_host_sim::recording::{RecordedEvent, Recording};
use agv_host_sim::replay::replay;
use agv_host_sim::simulate::scenario::{MotionReport, Scenario};
use agv_host_sim::simulate::simulate;

use super::check::{GOOD, replayed, run as run_command};
use crate::support::{Files, text};

const HALL: &str = include_str!("../../../host-sim/scenarios/warehouse_hall.toml");

const VEHICLES: [(&str, MotionReport); 3] = [
    ("tricycle", MotionReport::Encoders),
    ("differential", MotionReport::Differential),
    ("omni4", MotionReport::Omnidirectional),
];

#[derive(Clone, Copy, Debug, PartialEq)]
enum By {
    Reflectors,
    Features,
    Contours,
}

const ALL_BY: [By; 3] = [By::Reflectors, By::Features, By::Contours];

/// A mistake: its name, what is changed of what is believed or recorded, and how a finding names it.
struct Mistake {
    name: &'static str,
    plant: fn(&mut Recording),
    named: &'static [&'static str],
}

fn scale(recording: &mut Recording, factor: f64) {
    let vehicle = &mut recording.parameters.vehicle;
    for counter in vehicle.counters().iter().filter(|counter| counter.counted == Counted::Turn) {
        assert!(with_counter_scale(vehicle, counter.wheel, Counted::Turn, |scale| factor * scale));
    }
}

fn late(recording: &mut Recording, seconds: f64) {
    for event in &mut recording.events {
        match event {
            RecordedEvent::Reflectors(seen) => {
                seen.observations.iter_mut().for_each(|one| one.time = one.time.offset(seconds));
            }
            RecordedEvent::Scan(scan) => scan.start = scan.start.offset(seconds),
            _ => {}
        }
    }
}

fn start_off(recording: &mut Recording) {
    for event in &mut recording.events {
        if let RecordedEvent::SetPose(fix) = event {
            (fix.pose.x, fix.pose.y) = (fix.pose.x + 2.4, fix.pose.y - 1.1);
        }
    }
}

/// Of every vehicle.
const COMMON: [Mistake; 5] = [
    Mistake {
        name: "scale halved",
        plant: |drive| scale(drive, 0.5),
        named: &[
            "is 1.99",
            "is 2.00",
            "is 2.01",
            "drive scale is off",
            "drive scale is 0.000249",
            "drive scale is 0.000250",
        ],
    },
    Mistake {
        name: "yaw -45 deg",
        plant: |drive| {
            let mount = drive.parameters.lasers.first_mut();
            mount.theta = wrap(mount.theta + 45.0_f64.to_radians());
        },
        named: &["turned by -44.", "turned by -45."],
    },
    Mistake { name: "60 ms late", plant: |drive| late(drive, 0.06), named: &["times are 5", "times are 6"] },
    Mistake { name: "200 ms late", plant: |drive| late(drive, 0.2), named: &["times are 19", "times are 20"] },
    Mistake { name: "start off by 2.6 m", plant: start_off, named: &["the start pose is off by 2."] },
];

/// Of one vehicle.
fn own(reports: MotionReport) -> Mistake {
    match reports {
        MotionReport::Encoders => Mistake {
            name: "steering offset 45 deg",
            plant: |drive| {
                let Vehicle::Tricycle(tricycle) = &mut drive.parameters.vehicle else { panic!() };
                tricycle.steering_offset_forward -= 45.0_f64.to_radians();
                tricycle.steering_offset_backward -= 45.0_f64.to_radians();
            },
            named: &["is off by 44", "is off by 45"],
        },
        _ => Mistake {
            name: "wheel 2 reversed",
            plant: |drive| assert!(with_counter_scale(&mut drive.parameters.vehicle, 1, Counted::Turn, |scale| -scale)),
            named: &["the counter of wheel 2 counts the wrong way"],
        },
    }
}

fn drive(reports: MotionReport, by: By) -> Recording {
    let mut scenario = Scenario::parse(HALL).unwrap();
    scenario.vehicle.reports = reports;
    scenario.laser.scans = by != By::Reflectors;
    scenario.laser.beams = 720;
    let mut recording = simulate(&scenario).unwrap().recording;
    if by == By::Reflectors {
        return recording;
    }
    recording.events.retain(|event| !matches!(event, RecordedEvent::Reflectors(_)));
    recording.landmarks.clear();
    if by == By::Features {
        recording.landmarks = map_features_at(&recording, &recording.truth, &Clustering::default()).unwrap();
        recording.parameters.maps.features = true;
    }
    recording
}

fn findings(recording: &Recording) -> Vec<Finding> {
    let replay = replay(recording, |_| ()).unwrap();
    let figures = Figures::new(recording, &replay, &Track::new(recording, &replay));
    check(recording, &replay, &figures, "drive.agvlog", |_| ())
}

/// Whether a mistake is named by the findings, and how many causes they name.
fn is_named(mistake: &Mistake, found: &[Finding]) -> bool {
    found.iter().any(|finding| mistake.named.iter().any(|words| finding.what.contains(words)))
}

/// How a case ended.
struct Outcome {
    name: String,
    is_named: bool,
    is_wrong_alone: bool,
    /// 95 per cent of the drive are nearer than this to the truth without a mistake, and behind the command that is named, mm.
    sound: f64,
    after: Option<f64>,
    said: String,
}

fn run(reports: (&str, MotionReport), by: By, planted: &[&Mistake]) -> Outcome {
    let mut recording = drive(reports.1, by);
    planted.iter().for_each(|mistake| (mistake.plant)(&mut recording));
    // That a drive by contours has no map of landmarks is no mistake.
    let found: Vec<Finding> = findings(&recording)
        .into_iter()
        .filter(|finding| !(by == By::Contours && finding.what == "the log has no map"))
        .collect();
    let names: Vec<&str> = planted.iter().map(|mistake| mistake.name).collect();
    // A clock or a start may have to be mended before the other shows.
    let count = planted.iter().filter(|mistake| is_named(mistake, &found)).count();
    let said: Vec<String> = found.iter().map(|finding| format!("{} -> {}", finding.what, finding.next)).collect();
    let is_few = found.len() <= 2;
    // A page that shows the drive mends nothing, and does not end.
    let command = |finding: &Finding| finding.next.find("agv ").map(|start| finding.next[start..].to_owned());
    let mends = |command: &String| !command.starts_with("agv view");
    let next = found.iter().filter_map(command).find(mends);
    let right = drive(reports.1, by);
    let after = next.as_ref().map(|command| mended(&recording, command, (by == By::Contours).then_some(&right)));
    let sound = if after.is_some() { accuracy(&right, by) } else { 0.0 };
    Outcome {
        sound,
        name: format!("{}, {by:?}, {}", reports.0, names.join(" and ")),
        is_named: count > 0 && is_few,
        is_wrong_alone: count == 0 && !found.is_empty(),
        after,
        said: said.join(" | "),
    }
}

/// 95 per cent of a drive are nearer than this to the truth, mm.
fn accuracy(recording: &Recording, by: By) -> f64 {
    let files = Files::new();
    log::write(Path::new(&files.path("drive.agvlog")), recording).unwrap();
    let map = (by == By::Contours).then_some(recording);
    replayed(&files, &[&["drive.agvlog"], in_map(&files, map)].concat())
}

/// What a replay is told of the map of contours of a drive, if there is one.
fn in_map(files: &Files, right: Option<&Recording>) -> &'static [&'static str] {
    let Some(right) = right else { return &[] };
    log::write(Path::new(&files.path("right.agvlog")), right).unwrap();
    let words = ["map", "right.agvlog", "--kind", "contours", "--output", "contours.csv"];
    assert!(run_command(files, &words).status.success());
    &["--map", "contours.csv"]
}

/// 95 per cent of the drive are nearer than this to the truth after the command, mm; in a map of contours of the drive without a mistake,
/// if that is given.
fn mended(recording: &Recording, next: &str, right: Option<&Recording>) -> f64 {
    let files = Files::new();
    log::write(Path::new(&files.path("drive.agvlog")), recording).unwrap();
    let command = next.split("; or: ").next().unwrap();
    let map = in_map(&files, right);
    if command.starts_with("agv replay") {
        let words: Vec<&str> = command.split_whitespace().skip(2).chain(map.iter().copied()).collect();
        return replayed(&files, &words);
    }
    if !is_followed(&files, command) {
        return f64::INFINITY;
    }
    let log: &[&str] = if command.contains("--put-right") {
        &["mended.agvlog"]
    } else {
        &["drive.agvlog", "--vehicle", "vehicle.toml"]
    };
    replayed(&files, &[log, map].concat())
}

fn is_followed(files: &Files, command: &str) -> bool {
    let words: Vec<&str> = command.split_whitespace().skip(1).collect();
    let output = run_command(files, &words);
    if !output.status.success() {
        println!("{command}: {}", text(&output.stderr));
    }
    output.status.success()
}

#[test]
fn sixty_planted_mistakes_are_named() {
    let is_long = std::env::var_os("AGV_LONG").is_some();
    let mut cases: Vec<((&str, MotionReport), By, Vec<Mistake>)> = Vec::new();
    for vehicle in VEHICLES {
        for by in ALL_BY {
            let has_start = by != By::Contours;
            let singles = COMMON.into_iter().chain([own(vehicle.1)]);
            for mistake in singles.filter(|mistake| has_start || !mistake.name.starts_with("start")) {
                cases.push((vehicle, by, vec![mistake]));
            }
            let [scale, yaw, ..] = COMMON;
            cases.push((vehicle, by, vec![scale, yaw]));
        }
    }
    assert_eq!(cases.len(), 60);
    let (stride, most) = if is_long { (1, cases.len()) } else { (6, cases.len() / 3) };
    let (mut named, mut wrong, mut unsound, mut count) = (0, Vec::new(), Vec::new(), 0);
    for (vehicle, by, mistakes) in cases.iter().take(most).step_by(stride) {
        let outcome = run(*vehicle, *by, &mistakes.iter().collect::<Vec<_>>());
        let after =
            outcome.after.map_or_else(String::new, |after| format!("{after:.0} mm after, {:.0} sound", outcome.sound));
        println!("{:<52} named {} {after:<24} {}", outcome.name, outcome.is_named, outcome.said);
        count += 1;
        named += usize::from(outcome.is_named);
        if outcome.after.is_some_and(|after| after >= GOOD) {
            unsound.push(outcome.name.clone());
        }
        if outcome.is_wrong_alone {
            wrong.push(outcome.name);
        }
    }
    println!("{named} of {count} named; a wrong one alone: {wrong:?}");
    assert!(10 * named >= 9 * count, "{named} of {count}");
    assert!(wrong.is_empty(), "{wrong:?}");
    assert!(unsound.is_empty(), "not sound after the command: {unsound:?}");
}
