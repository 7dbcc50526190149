//! Poses as `evo` evaluates them.

use std::path::Path;

use agv_host_sim::log;
use agv_tests::python;
use serde_json::Value;

use super::hall::hall;
use crate::support::{Files, agv, text};

/// Prints the statistics that evo_ape stores.
const RESULTS: &str = "import json, sys, zipfile; print(zipfile.ZipFile(sys.argv[1]).read('stats.json').decode())";

#[test]
fn evo_finds_the_errors_that_a_replay_prints() {
    let test = "evo_finds_the_errors_that_a_replay_prints";
    let Some(_) = python(test, "evo") else { return };
    let files = Files::new();
    let [log_path, estimate, truth] = ["a.agvlog", "a.tum", "truth.tum"].map(|name| files.path(name));
    log::write(Path::new(&log_path), &hall(12.0)).unwrap();
    let exported = agv(&["export", "tum", &log_path, "-o", &estimate, "--truth", &truth]);
    assert!(exported.status.success(), "{}", text(&exported.stderr));
    let replayed = agv(&["replay", &log_path, "--json"]);
    let figures: Value = serde_json::from_slice(&replayed.stdout).unwrap();
    for (relation, key, scale) in [("trans_part", "position_mm", 1e3), ("angle_deg", "heading_deg", 1.0)] {
        let results = files.path(&format!("{relation}.zip"));
        let mut evo = python(test, "evo").unwrap();
        // It keeps its settings at home.
        evo.env("HOME", files.folder())
            .args(["-c", "import sys; from evo.cli.entry_points import ape; sys.exit(ape())"]);
        let output = evo.args(["tum", &truth, &estimate, "-r", relation, "--save_results", &results]).output().unwrap();
        assert!(output.status.success(), "{}", text(&output.stderr));
        let output = python(test, "evo").unwrap().args(["-c", RESULTS, &results]).output().unwrap();
        let found: Value = serde_json::from_slice(&output.stdout).unwrap();
        for (theirs, ours) in [("median", "median"), ("max", "max")] {
            let theirs = found[theirs].as_f64().unwrap() * scale;
            let ours = figures["accuracy"][key][ours].as_f64().unwrap();
            assert!((theirs - ours).abs() < 1e-6 && ours > 1e-3, "{relation}: {theirs} and {ours}");
        }
    }
}

#[test]
fn a_table_has_a_row_for_each_pose() {
    let files = Files::new();
    let [log_path, table] = ["a.agvlog", "a.csv"].map(|name| files.path(name));
    let recording = hall(2.0);
    log::write(Path::new(&log_path), &recording).unwrap();
    let exported = agv(&["export", "csv", &log_path, "-o", &table, "--json"]);
    let counts: Value = serde_json::from_slice(&exported.stdout).unwrap();
    let mut reader = csv::Reader::from_path(&table).unwrap();
    let columns = reader.headers().unwrap().clone();
    let column = |name: &str| columns.iter().position(|column| column == name).unwrap();
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    assert_eq!(counts["poses"].as_u64().unwrap(), rows.len() as u64);
    let value = |row: &csv::StringRecord, name: &str| row[column(name)].parse::<f64>().unwrap();
    assert!(rows.windows(2).all(|pair| value(&pair[0], "time_s") < value(&pair[1], "time_s")));
    for row in &rows {
        let error = (value(row, "x_m") - value(row, "true_x_m")).hypot(value(row, "y_m") - value(row, "true_y_m"));
        assert!(error < 0.05, "{row:?}");
        assert!(["reflectors", "dead_reckoning"].contains(&&row[column("mode")]), "{row:?}");
    }
}
