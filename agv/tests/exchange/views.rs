//! Pages that the command serves and writes.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::AtomicBool;

use agv_core::localizer::{LandmarkUse, Mode, PoseOutput};
use agv_core::maps::{LandmarkKind, Verdict};
use agv_core::measurement::Time;
use agv_core::record::{Output, Record};
use agv_host_sim::log;
use agv_host_sim::recording::RecordedEvent;
use agv_host_sim::replay::replay;
use agv_host_sim::view::{Shared, Timeline, Window, load};
use agv_tests::skip;
use serde_json::Value;

use super::hall::hall;
use crate::support::{Files, agv, refusal, text};

fn get(address: &str, path: &str, host: &str) -> String {
    let mut stream = TcpStream::connect(address).unwrap();
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer
}

#[test]
fn a_page_is_served_to_this_machine_only() {
    let files = Files::new();
    let log_path = files.path("drive.agvlog");
    log::write(Path::new(&log_path), &hall(2.0)).unwrap();
    let mut served = Command::new(env!("CARGO_BIN_EXE_agv"))
        .args(["view", &log_path, "--port", "0", "--json"])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    BufReader::new(served.stdout.take().unwrap()).read_line(&mut line).unwrap();
    let announced: Value = serde_json::from_str(&line).unwrap();
    let address = announced["url"].as_str().unwrap().trim_start_matches("http://").trim_end_matches('/').to_owned();
    let page = get(&address, "/", &address);
    let foreign = get(&address, "/", "evil.example:80");
    let moment = get(&address, "/api/moment?time_s=1.5", "localhost");
    let wrong = get(&address, "/api/moment?time_s=soon", "localhost");
    served.kill().unwrap();
    served.wait().unwrap();
    assert!(address.starts_with("127.0.0.1:"), "{address}");
    assert!(page.starts_with("HTTP/1.1 200") && page.contains("window.agv"));
    // Nothing from elsewhere.
    let (_, body) = page.split_once("\r\n\r\n").unwrap();
    for outside in ["http://", "https://", "@import", "src=", "url("] {
        assert!(!body.contains(outside), "{outside}");
    }
    assert!(foreign.starts_with("HTTP/1.1 403"), "{foreign}");
    assert!(moment.starts_with("HTTP/1.1 200") && moment.contains("\"health\""), "{moment}");
    assert!(wrong.starts_with("HTTP/1.1 400"), "{wrong}");
}

#[test]
fn what_cannot_be_viewed_or_reported_is_refused() {
    let files = Files::new();
    let output = files.path("out.html");
    let inputs = [
        files.path("missing.agvlog"),
        files.write("empty.agvlog", b""),
        files.write("foreign.agvlog", b"t_s,x_m\n1,2\n"),
    ];
    for input in &inputs {
        let name = Path::new(input).file_name().unwrap().to_str().unwrap();
        assert!(refusal(&["view", input]).contains(name));
        assert!(refusal(&["report", input, "-o", &output]).contains(name));
        assert!(!Path::new(&output).exists());
    }
}

#[test]
fn a_report_puts_drives_side_by_side() {
    let files = Files::new();
    let [before, after, page, pdf] =
        ["before.agvlog", "after.agvlog", "report.html", "report.pdf"].map(|name| files.path(name));
    let mut recording = hall(6.0);
    log::write(Path::new(&before), &recording).unwrap();
    recording.parameters.reflectors.range_deviation = 0.037;
    log::write(Path::new(&after), &recording).unwrap();
    let run = agv(&["report", &before, &after, "-o", &page, "--json"]);
    assert!(run.status.success(), "{}", text(&run.stderr));
    let figures: Value = serde_json::from_slice(&run.stdout).unwrap();
    assert_eq!((&figures[0]["name"], &figures[1]["name"]), (&"before".into(), &"after".into()));
    // Each has the figures that its replay has.
    for (log_path, entry) in [(&before, &figures[0]), (&after, &figures[1])] {
        let replayed: Value = serde_json::from_slice(&agv(&["replay", log_path, "--json"]).stdout).unwrap();
        assert_eq!(replayed["accuracy"], entry["accuracy"]);
    }
    let html = std::fs::read_to_string(&page).unwrap();
    let headings =
        ["Summary", "Health", "Ways side by side", "Innovations", "Use of landmarks", "Parameters that differ"];
    for expected in headings.iter().chain(&["0.037", "agv ", "longest silence, laser"]) {
        assert!(html.contains(expected), "{expected}");
    }
    // Parameters that are the same are left out where drives are compared.
    assert!(html.contains("range_deviation") && !html.contains("lost_after"));
    let alone = files.path("alone.html");
    assert!(agv(&["report", &before, "-o", &alone]).status.success());
    assert!(std::fs::read_to_string(&alone).unwrap().contains("lost_after"));
    let run = agv(&["report", &before, "-o", &page, "--pdf", &pdf]);
    if text(&run.stderr).contains("needs Chromium") {
        skip("a_report_puts_drives_side_by_side", "Chromium is not there to print");
        return;
    }
    assert!(run.status.success(), "{}", text(&run.stderr));
    assert!(std::fs::read(&pdf).unwrap().starts_with(b"%PDF-"));
}

#[test]
fn shells_are_told_every_command() {
    for shell in ["bash", "zsh", "fish"] {
        let script = agv(&["completion", shell]);
        assert!(script.status.success());
        for command in ["view", "report", "export", "layout"] {
            assert!(text(&script.stdout).contains(command), "{shell} {command}");
        }
    }
    assert_eq!(agv(&["completion", "dosh"]).status.code(), Some(2));
}

#[test]
fn quiet_says_results_and_errors_only() {
    let files = Files::new();
    let scenario = concat!(env!("CARGO_MANIFEST_DIR"), "/../host-sim/scenarios/block_storage_p1.toml");
    let talkative = agv(&["simulate", scenario]);
    assert!(!talkative.stderr.is_empty());
    let quiet = agv(&["simulate", scenario, "--quiet"]);
    assert!(quiet.stderr.is_empty() && quiet.stdout == talkative.stdout);
    let refused = agv(&["replay", &files.path("missing"), "--quiet"]);
    assert_eq!((refused.status.code(), text(&refused.stderr).lines().count()), (Some(1), 1));
}

#[test]
fn what_is_sent_coarsely_hides_nothing() {
    let files = Files::new();
    let log_path = files.path("drive.agvlog");
    let recording = hall(20.0);
    log::write(Path::new(&log_path), &recording).unwrap();
    let answers = replay(&recording, |_| ()).unwrap();
    let shared = Shared::new(Timeline::of_log(log_path.clone().into()));
    load(Path::new(&log_path), &shared, &AtomicBool::new(false)).unwrap();
    let timeline = shared.read();
    let status = timeline.status();
    let scans = recording.events.iter().filter(|event| matches!(event, RecordedEvent::Scan(_))).count();
    assert!(status.is_complete && status.scans == scans && status.landmarks == recording.landmarks.len());
    let poses: Vec<PoseOutput> = answers.poses.iter().filter(|pose| pose.mode != Mode::NotLocalised).copied().collect();

    // The way: every pose is near a point of it, and it has fewer points the coarser it is.
    let mut counts = Vec::new();
    for tolerance_m in [0.01, 0.1, 1.0] {
        let everywhere = Window { tolerance_m, x0: -1e3, y0: -1e3, x1: 1e3, y1: 1e3 };
        let outline = timeline.outline(&everywhere);
        let points: Vec<[f64; 2]> = outline
            .pieces
            .iter()
            .flat_map(|(_, points)| points.chunks(2))
            .map(|point| [f64::from(point[0]) * 1e-3, f64::from(point[1]) * 1e-3])
            .collect();
        for pose in &poses {
            let distance = |point: &[f64; 2]| (point[0] - pose.pose.x).hypot(point[1] - pose.pose.y);
            let nearest = points.iter().map(distance).fold(f64::INFINITY, f64::min);
            assert!(nearest <= tolerance_m + 0.002, "{nearest} at {tolerance_m}");
        }
        counts.push(points.len());
        let nowhere = Window { tolerance_m, x0: -20.0, y0: -20.0, x1: -10.0, y1: -10.0 };
        assert!(timeline.outline(&nowhere).pieces.is_empty());
    }
    assert!(counts[0] > 2 * counts[1] && counts[1] > 2 * counts[2], "{counts:?}");

    // Curves: the largest value of all is in every answer, however coarse.
    let largest = poses.iter().map(|pose| pose.normalised_square as f32).fold(0.0, f32::max);
    for intervals in [1, 7, 100, 1000] {
        let [from, to] = [status.start_s, status.end_s].map(Time::from_seconds);
        let overview = timeline.overview(from, to, intervals);
        assert_eq!(overview.normalised_square.len(), intervals);
        assert_eq!(overview.normalised_square.iter().flatten().copied().fold(0.0, f32::max), largest);
        // It began without a landmark, which is graver than what followed.
        let first = overview.modes.iter().flatten().next().map(|mode| overview.mode_names[usize::from(*mode)]);
        assert_eq!(first, Some("dead reckoning"));
    }
}

#[test]
fn features_are_called_contours_where_no_landmark_among_them_leads() {
    let recording = hall(6.0);
    let answers = replay(&recording, |_| ()).unwrap();
    let accepted = answers.uses.iter().find(|one| one.verdict == Verdict::Accepted).unwrap();
    let pose = PoseOutput { mode: Mode::Features, ..*answers.poses.last().unwrap() };
    let corner = LandmarkUse { kind: LandmarkKind::Corner, ..*accepted };
    let gated = LandmarkUse { verdict: Verdict::Gated, ..corner };
    for (uses, name) in
        [(&[][..], "contours"), (&[*accepted], "contours"), (&[gated], "contours"), (&[corner], "features")]
    {
        let mut timeline = Timeline::of_controller("here");
        timeline.take(&Record::Output(Output { pose, uses }), 0);
        let [from, to] = [timeline.status().start_s, timeline.status().end_s + 1.0].map(Time::from_seconds);
        let overview = timeline.overview(from, to, 1);
        assert_eq!(overview.modes[0].map(|mode| overview.mode_names[usize::from(mode)]), Some(name));
        assert_eq!(timeline.happenings()[0].text.split(':').next(), Some(name));
    }
}
