//! `agv evaluate trust`: what is told is of the settings that are named beside it.

use crate::support::{Files, agv, text};

const KINDS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../host-sim/scenarios/trust.toml");

fn spot_check(more: &[&str]) -> serde_json::Value {
    let output =
        agv(&[&["evaluate", "trust", "--kinds", KINDS, "--sample", "1", "--seed", "2", "--json", "-q"], more].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn a_setting_changes_the_runs_and_is_told_beside_them() {
    let files = Files::new();
    let folder = files.folder();
    let usual = spot_check(&["--diagrams", &folder]);
    let other = spot_check(&["--set", "odometry.slip=0.02"]);
    assert_eq!(usual["settings"], serde_json::json!([]));
    assert_eq!(other["settings"], serde_json::json!(["odometry.slip=0.02"]));
    assert_ne!(usual["stanford_faults"], other["stanford_faults"]);
    for name in ["stanford_nominal.svg", "stanford_faults.svg"] {
        let diagram = std::fs::read_to_string(files.path(name)).unwrap();
        assert!(diagram.starts_with("<svg ") && diagram.ends_with("</svg>\n"), "{name}");
        assert_eq!(diagram.lines().count(), 1, "{name}");
    }
}

/// Rows that were made before do not say by which settings.
#[test]
fn rows_of_another_run_take_no_settings() {
    for more in
        [&["--merge", "rows.jsonl"][..], &["--swept", "rows.jsonl"], &["--shard", "0/2", "--output", "rows.jsonl"]]
    {
        let output = agv(&[&["evaluate", "trust", "--set", "odometry.slip=0.02"], more].concat());
        assert_eq!(output.status.code(), Some(2), "{more:?}: {}", text(&output.stderr));
        assert!(text(&output.stderr).contains("--set"), "{more:?}: {}", text(&output.stderr));
    }
}

/// A run of an hour must not end in that.
#[test]
fn what_cannot_be_written_is_said_before_the_runs() {
    let files = Files::new();
    let nowhere = format!("{}/nowhere", files.folder());
    let page = format!("{nowhere}/page.html");
    for more in [["--diagrams", nowhere.as_str()], ["--report", page.as_str()]] {
        let output = agv(&[&["evaluate", "trust", "--first-seed", "1"], &more[..]].concat());
        assert!(!output.status.success(), "{more:?}");
        let said = text(&output.stderr);
        assert!(said.contains("there is no folder") && said.lines().count() == 1, "{said}");
    }
}
