//! The judge of a campaign, its files, and what bad ones are answered.

use std::path::Path;
use std::process::Command;

use agv_core::geometry::Pose;
use agv_core::measurement::Time;
use agv_core::state::{Mode, PoseOutput, Reason};
use agv_lab::campaign::results::{self, Row};
use agv_lab::campaign::verdict::{AlertLimits, Class, Judge, Verdict};

fn output(time: Time, x: f64, mode: Mode) -> PoseOutput {
    PoseOutput {
        time,
        pose: Pose::new(x, 0.0, 0.0),
        covariance: [1e-6, 0.0, 1e-6, 0.0, 0.0, 1e-8],
        mode,
        reason: Reason::None,
        dead_reckoning_distance: 0.0,
        correction: 0.0,
        smooth: Pose::default(),
        level: agv_core::integrity::ProtectionLevel { position: 0.06, heading: 0.02 },
        acceptance: 1.0,
        normalised_square: 2.0,
        resets: 0,
        last_reset: 0.0,
        overflows: 0,
    }
}

/// A vehicle that goes on by 1 m/s for ten seconds, and a controller that is wrong by `error` m and says `mode`.
fn judged(error: impl Fn(f64) -> f64, mode: impl Fn(f64) -> Mode) -> Verdict {
    let mut judge = Judge::new(AlertLimits::default(), 2.0);
    for step in 0..1000_u32 {
        let time = f64::from(step) * 0.01;
        let now = Time::from_micros(5_000_000).offset(time);
        let truth = |at: Time| Some(Pose::new(at.since(Time::from_micros(5_000_000)), 0.0, 0.0));
        let said = output(now, time + error(time), mode(time));
        judge.hear(now, time, Some(&said), &truth);
    }
    judge.verdict(&[])
}

#[test]
fn a_controller_that_is_right_has_nothing_to_say() {
    let verdict = judged(|_| 0.01, |_| Mode::Reflectors);
    assert_eq!(verdict.class, Class::Unimpressed);
    assert!(verdict.is_recovered && verdict.violations == 0 && verdict.degraded_s == 0.0);
}

#[test]
fn a_controller_that_lies_is_found() {
    let verdict = judged(|time| if time > 4.0 { 0.5 } else { 0.0 }, |_| Mode::Reflectors);
    assert_eq!(verdict.class, Class::Misleading);
    assert!((verdict.late_s - 5.99).abs() < 0.02 && (verdict.late_m - 5.99).abs() < 0.02, "{verdict:?}");
    assert!(!verdict.is_recovered);
}

#[test]
fn a_controller_that_says_so_late_is_late_by_as_much() {
    let error = |time| if time > 4.0 { 0.5 } else { 0.0 };
    let verdict = judged(error, |time| if time > 4.405 { Mode::Lost } else { Mode::Reflectors });
    assert_eq!(verdict.class, Class::Late);
    assert!((verdict.late_s - 0.4).abs() < 0.02, "{verdict:?}");
    let said = verdict.said_after_s.unwrap();
    assert!((said - 2.41).abs() < 0.02, "{said}");
}

#[test]
fn a_controller_that_says_so_is_believed() {
    let error = |time| if (4.0..6.0).contains(&time) { 5.0 } else { 0.0 };
    let mode = |time| if (3.9..6.1).contains(&time) { Mode::Degraded } else { Mode::Reflectors };
    let verdict = judged(error, mode);
    assert_eq!((verdict.class, verdict.is_recovered), (Class::Said, true));
    assert!((verdict.degraded_s - 2.2).abs() < 0.02 && verdict.worst_position_m < 1e-6, "{verdict:?}");
}

#[test]
fn an_old_pose_says_nothing() {
    let mut judge = Judge::new(AlertLimits::default(), 0.0);
    let truth = |_: Time| Some(Pose::default());
    for step in 0..200_u32 {
        let now = Time::from_micros(5_000_000).offset(f64::from(step) * 0.01);
        let said = output(Time::from_micros(5_000_000), 0.0, Mode::Reflectors);
        judge.hear(now, f64::from(step) * 0.01, Some(&said), &truth);
    }
    let verdict = judge.verdict(&[]);
    assert!((verdict.degraded_s - 1.89).abs() < 0.02, "{verdict:?}");
}

fn row(run: i64, fault: &str) -> Row {
    Row { run, fault: fault.to_owned(), class: "said".to_owned(), late_s: 0.25, can_recover: true, ..Row::default() }
}

#[test]
fn a_table_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rows.parquet");
    let rows = vec![row(0, "a"), Row { said_after_s: f64::INFINITY, ..row(1, "b, with ü") }];
    results::write(&path, &rows).unwrap();
    assert_eq!(results::read(&path).unwrap(), rows);
    let once = std::fs::read(&path).unwrap();
    results::write(&path, &rows).unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), once);
}

fn complaint(arguments: &[&str], folder: &Path) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_agv")).args(arguments).current_dir(folder).output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{arguments:?}");
    assert!(output.stdout.is_empty(), "{arguments:?}");
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(message.lines().count(), 1, "{message}");
    message
}

#[test]
fn a_bad_campaign_is_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("scenario.toml", "seed = 1\n");
    let head = "scenario = \"scenario.toml\"\nseconds = 5.0\nruns = 1\n";
    let fault = |name: &str, kind: &str| format!("[[fault]]\nname = \"{name}\"\nwhat = {{ kind = \"{kind}\" }}\n");
    write("unknown.toml", &format!("{head}{}", fault("a", "gremlins")));
    write("twice.toml", &format!("{head}{0}{0}", fault("a", "nothing")));
    write("rubbish.parquet", "PAR1 but not really");
    let of = |file: &str| complaint(&["campaign", file], folder.path());
    assert!(of("absent.toml").contains("absent.toml"));
    assert!(of("unknown.toml").contains("line 6") && of("unknown.toml").contains("gremlins"), "{}", of("unknown.toml"));
    assert!(of("twice.toml").contains("\"a\""));
    assert!(of("rubbish.parquet").contains("rubbish.parquet"));
    assert!(complaint(&["campaign", "a.parquet", "b.toml"], folder.path()).contains("one campaign"));
    write("good.toml", &format!("{head}{}", fault("a", "nothing")));
    assert!(complaint(&["campaign", "good.toml", "--only", "z"], folder.path()).contains("no fault"));
    // The standard scenario has no reflectors.
    assert!(of("good.toml").contains("neither scans nor reflectors"), "{}", of("good.toml"));
}
