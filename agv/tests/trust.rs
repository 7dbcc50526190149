//! `agv evaluate trust`, whose figures are of the settings that are named beside them, and `agv evaluate trial`, single runs of it.

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

/// Rows of a sweep beside those of the worst sizes tell what every size has shown.
#[test]
fn every_size_is_told_where_the_sweep_is_known() {
    let files = Files::new();
    let (rows, page, report) = (files.path("rows.jsonl"), files.path("threats.md"), files.path("report.html"));
    let kind = ["evaluate", "trust", "--kinds", KINDS, "--only", "start turned", "-q"];
    let sweep = ["--first-seed", "5", "--sweep-runs", "1", "--shard", "0/1", "--output", &rows];
    let output = agv(&[&kind[..], &sweep].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let merge = ["--merge", &rows, "--swept", &rows, "--threats", &page, "--report", &report, "--json"];
    let output = agv(&[&kind[..], &merge].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let of = &told["per_fault"][0];
    let sizes = of["sizes"].as_array().unwrap();
    assert!(sizes.len() >= 9 && sizes.iter().any(|size| size["size"] == of["worst_size"]), "{of}");
    let page = std::fs::read_to_string(page).unwrap();
    assert_eq!(page.matches("| start turned |").count(), 2, "{page}");
    let last = sizes.last().unwrap()["size"].to_string();
    let curve = page.lines().last().unwrap();
    assert!(curve.contains(&format!(" {}: ", last.trim_end_matches(".0"))), "{curve}");
    assert_eq!(std::fs::read_to_string(report).unwrap().matches("<td>start turned").count(), 1 + sizes.len());
}

/// What a run of the table shows alone, it shows again; and its trace has every output, with the errors that were counted.
#[test]
fn a_run_of_the_table_is_made_again_alone() {
    let files = Files::new();
    let (rows, trace) = (files.path("rows.jsonl"), files.path("trace.csv"));
    let sweep =
        ["evaluate", "trust", "--kinds", KINDS, "--only", "start turned", "--first-seed", "5", "--sweep-runs", "1"];
    let output = agv(&[&sweep[..], &["--shard", "0/1", "-q", "--output", &rows]].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let rows = std::fs::read_to_string(&rows).unwrap();
    let of_table: serde_json::Value = serde_json::from_str(rows.lines().last().unwrap()).unwrap();
    let fault = format!("start turned={}", of_table["size"]);
    let trial = ["evaluate", "trial", "--kinds", KINDS, "--fault", &fault, "--seed", "5", "--json", "-q"];
    let output = agv(&[&trial[..], &["--trace", &trace]].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let alone: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(alone, serde_json::json!([of_table]));

    let trace = std::fs::read_to_string(&trace).unwrap();
    let columns: Vec<&str> = trace.lines().next().unwrap().split(',').collect();
    let lines: Vec<Vec<&str>> = trace.lines().skip(1).map(|line| line.split(',').collect()).collect();
    assert!(lines.iter().all(|line| line.len() == columns.len()));
    let outcome = &of_table["outcome"];
    assert_eq!(lines.len() as u64, outcome["outputs"].as_u64().unwrap());
    let column = |name: &str| columns.iter().position(|column| *column == name).unwrap();
    let number = |line: &[&str], name: &str| line[column(name)].parse::<f64>().ok();
    let is_claim = |line: &&Vec<&str>| {
        number(line, "age_s").is_some_and(|age| age <= 0.1)
            && !["not localised", "lost"].contains(&line[column("mode")])
    };
    let claims: Vec<_> = lines.iter().filter(is_claim).collect();
    assert_eq!(claims.len() as u64, outcome["claims"].as_u64().unwrap());
    let over = |line: &Vec<&str>| {
        let share = |error: &str, level: &str| number(line, error).unwrap() / number(line, level).unwrap();
        share("error_m", "level_m").max(share("error_rad", "level_rad"))
    };
    let most = claims.into_iter().map(over).fold(0.0, f64::max);
    let counted = outcome["most_over_level"].as_f64().unwrap();
    assert!((most - counted).abs() < 0.01 * counted + 0.01, "{most} {counted}");
}

#[test]
fn a_trial_that_cannot_be_made_is_refused_in_one_line() {
    for (more, said) in [
        (&["--fault", "carried of=3"][..], "no kind of fault is called \"carried of\""),
        (&["--fault", "carried on"], "has a size"),
        (&["--fault", "carried on=far"], "is no number"),
        (&["--fault", "power cut=1", "--fault", "power cut=1", "--fault", "power cut=1"], "two faults"),
        (&["--runs", "2", "--trace", "trace.csv"], "--trace is of one run"),
        (&["--trace", "nowhere/trace.csv"], "there is no folder"),
        (&["--fault", "drive encoder frozen=5", "--vehicle", "increments"], "cannot have"),
    ] {
        let output = agv(&[&["evaluate", "trial", "--kinds", KINDS], more].concat());
        assert!(!output.status.success(), "{more:?}");
        let told = text(&output.stderr);
        assert!(told.contains(said) && told.lines().count() == 1, "{more:?}: {told}");
    }
}
