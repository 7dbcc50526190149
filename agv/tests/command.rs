//! The command as people run it.

use agv_host_sim::left_out::{BAGS, DRAWINGS, POINT_CLOUDS, POSE_GRAPHS};
use agv_lab::campaign::results::TABLES;
use agv_tests::recordings;
use std::path::{Path, PathBuf};

use crate::support::{Files, GRAPH, agv, refusal, text};

/// Names of the subcommands, as the help lists them.
fn subcommands() -> Vec<String> {
    let output = agv(&["--help"]);
    assert!(output.status.success());
    let help = text(&output.stdout).to_owned();
    let listed = help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    let names = listed.map(|line| line.split_whitespace().next().unwrap().to_owned());
    // clap's own command takes no options.
    names.filter(|name| name != "help").collect()
}

#[test]
fn every_command_explains_itself() {
    let commands = subcommands();
    for expected in ["import", "simulate", "replay", "map", "evaluate"] {
        assert!(commands.iter().any(|command| command == expected), "no {expected} in {commands:?}");
    }
    for command in &commands {
        let output = agv(&[command, "--help"]);
        assert!(output.status.success(), "{command}");
        assert!(text(&output.stdout).contains("Usage: agv"), "{command}");
    }
    assert!(text(&agv(&["--version"]).stdout).starts_with("agv "));
}

#[test]
fn candidates_of_the_block_storage_are_compared_on_a_page() {
    let files = Files::new();
    let report = files.path("candidates.html");
    let wanted = ["--map", "odometry", "--only", "P4", "--runs", "2", "--disturb", "none,scale"];
    let run = agv(&[&["evaluate", "warehouse", "--quiet", "--json", "--report", &report], &wanted[..]].concat());
    assert!(run.status.success() && run.stderr.is_empty(), "{}", text(&run.stderr));
    let experiments: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
    let html = std::fs::read_to_string(&report).unwrap();
    for experiment in experiments.as_array().unwrap() {
        let row = format!(
            "<td>{}</td><td>{}</td>",
            experiment["name"].as_str().unwrap(),
            experiment["disturbance"].as_str().unwrap()
        );
        assert!(html.contains(&row), "{row} is not in {html}");
    }
    // One path, so the worst path is this one.
    let p95 = format!(">{:.1}</td>", experiments[1]["position_mm"]["p95"].as_f64().unwrap());
    assert!(html.contains(&p95), "{p95} is not in {html}");
}

#[test]
fn import_refuses_bad_input_in_one_line() {
    let files = Files::new();
    let output = files.path("out.agvlog");
    let missing = files.path("missing.log");
    let inputs = [
        files.write("empty.log", b""),
        files.write("foreign.gz", b"\x1f\x8b\x08\0\0\0\0\0\0\0"),
        files.write("foreign.bin", &[0, 1, 2, 3, 200, 255]),
        files.write("foreign.txt", b"no recording at all\n"),
    ];
    for format in ["auto", "carpark", "sapienza", "carmen", "graph"] {
        let complaint = refusal(&["import", format, &missing, "-o", &output]);
        assert!(complaint.contains("missing.log"), "{complaint}");
        for input in &inputs {
            let complaint = refusal(&["import", format, input, "-o", &output]);
            assert!(complaint.contains(&file_name(input)), "{format}: {complaint}");
        }
        assert!(!Path::new(&output).exists(), "{format} left a log behind");
    }
    for format in ["auto", "carpark", "rosbag2", "optiodom", "mcap", "capture"] {
        let folder = files.path("no/such/folder");
        let complaint = refusal(&["import", format, &folder, "-o", &output]);
        assert_eq!(complaint, format!("agv: {folder}: there is no such file or folder\n"));
    }
    let nowhere = files.path("no/such/folder/out.agvlog");
    let good = files.write("good.log", GRAPH.as_bytes());
    assert!(refusal(&["import", "auto", &good, "-o", &nowhere]).contains("out.agvlog"));
}

/// The part of a path behind the last separator.
fn file_name(path: &str) -> String {
    PathBuf::from(path).file_name().unwrap().to_str().unwrap().to_owned()
}

#[test]
fn import_says_which_line_is_damaged() {
    let files = Files::new();
    let output = files.path("out.agvlog");
    let damaged = files.write("damaged.log", GRAPH.replace("VERTEX2 1 1 0 0.5", "VERTEX2 1 1 x 0.5").as_bytes());
    let complaint = refusal(&["import", "graph", &damaged, "-o", &output]);
    assert!(complaint.contains("damaged.log:3:"), "{complaint}");
}

#[test]
fn import_writes_a_log_and_a_summary() {
    let files = Files::new();
    let output = files.path("out.agvlog");
    let input = files.write("good.log", GRAPH.as_bytes());
    for format in ["auto", "graph"] {
        let run = agv(&["import", format, &input, "-o", &output, "--json"]);
        assert!(run.status.success(), "{}", text(&run.stderr));
        let summary: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
        assert_eq!((&summary["scans"], &summary["odometry"]), (&2.into(), &2.into()));
        let (recording, damages) = agv_host_sim::log::read(Path::new(&output)).unwrap();
        assert_eq!((recording.references.len(), damages.len()), (2, 0));
    }
}

#[test]
fn an_imported_log_exports_what_its_source_does() {
    let files = Files::new();
    let source = files.write("good.log", GRAPH.as_bytes());
    let log = files.path("good.agvlog");
    assert!(agv(&["import", "graph", &source, "-o", &log]).status.success());
    let [direct, imported] = ["direct", "imported"].map(|name| files.path(name));
    for (input, folder) in [(&source, &direct), (&log, &imported)] {
        let run = agv(&["features", "export", input, folder, "--json"]);
        assert!(run.status.success(), "{}", text(&run.stderr));
        let counts: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
        assert_eq!(counts["scans"], 2);
    }
    let numbers = |folder: &str, name: &str| -> Vec<f64> {
        let content = std::fs::read_to_string(Path::new(folder).join(name)).unwrap();
        content.split_whitespace().map(|word| word.parse().unwrap()).collect()
    };
    for name in ["scans.txt", "poses.txt"] {
        let (direct, imported) = (numbers(&direct, name), numbers(&imported, name));
        assert_eq!(direct.len(), imported.len());
        assert!(direct.iter().zip(&imported).all(|(a, b)| (a - b).abs() < 1e-9), "{name}: {direct:?} {imported:?}");
    }
}

#[test]
fn import_finds_out_what_the_real_data_are() {
    let Some(folder) = recordings("import_finds_out_what_the_real_data_are", "carpark") else { return };
    let files = Files::new();
    let output = files.path("out.agvlog");
    for (input, key, expected) in [
        ("carpark", "landmarks", 15),
        ("sapienza_tricycle/dataset.txt", "odometry", 2434),
        ("scans2d/intel-lab.log", "scans", 2672),
        ("scans2d/fhw-corrected.log.gz", "scans", 488),
    ] {
        let run =
            agv(&["import", "auto", folder.with_file_name("").join(input).to_str().unwrap(), "-o", &output, "--json"]);
        assert!(run.status.success(), "{input}: {}", text(&run.stderr));
        let summary: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
        assert_eq!(summary[key], expected, "{input}");
    }
}

#[test]
fn a_scenario_that_is_none_is_refused() {
    let files = Files::new();
    let output = files.path("out.agvlog");
    for scenario in [
        files.path("missing.toml"),
        files.write("empty.toml", b""),
        files.write("foreign.toml", b"\x1f\x8b\x08\0\0"),
        files.write("damaged.toml", b"[world\n"),
    ] {
        refusal(&["simulate", &scenario, "-o", &output]);
    }
    let complaint = refusal(&["simulate", &files.path("damaged.toml"), "-o", &output]);
    assert!(complaint.contains("damaged.toml:1: ") && !complaint.contains('|'), "{complaint}");
}

#[test]
fn whatever_reads_a_log_refuses_what_is_none() {
    let files = Files::new();
    let inputs = [
        files.path("missing.agvlog"),
        files.write("empty.agvlog", b""),
        files.write("foreign.agvlog", b"t_s,x_m\n1,2\n"),
        files.write("capture.agvlog", b"\xd4\xc3\xb2\xa1\x02\0\x04\0\0\0\0\0\xff"),
    ];
    let folder = files.path("folder");
    for input in &inputs {
        let complaint = refusal(&["features", "export", input, &folder]);
        assert!(complaint.contains(&file_name(input)), "{complaint}");
        assert!(!Path::new(&folder).exists());
    }
    // Commands that take a log, and nothing else that they must be given.
    let takes_log = |command: &String| {
        text(&agv(&[command, "--help"]).stdout)
            .lines()
            .any(|line| line.starts_with("Usage: ") && line.ends_with(" <LOG>") && !line.contains(" --"))
    };
    for command in subcommands().iter().filter(|command| takes_log(command)) {
        for input in &inputs {
            let complaint = refusal(&[command, input]);
            assert!(complaint.contains(&file_name(input)), "{complaint}");
        }
    }
}

#[test]
fn what_may_be_left_out_names_a_feature_of_the_command() {
    let manifest: toml::Table = include_str!("../Cargo.toml").parse().unwrap();
    let features = manifest["features"].as_table().unwrap();
    let full = features["full"].as_array().unwrap();
    let parts = [BAGS, DRAWINGS, POINT_CLOUDS, POSE_GRAPHS, TABLES];
    for part in parts {
        assert!(features.contains_key(part.feature()), "{part}");
        assert!(full.iter().any(|feature| feature.as_str() == Some(part.feature())), "{part}");
    }
    assert_eq!(full.len(), parts.len());
}
