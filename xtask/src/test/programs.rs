//! Builds the programs of the tests and runs them: those that wait beside those that compute, then those that emulate a board
//! in real time, and alone.

use std::collections::{BTreeSet, VecDeque};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, bail};
use serde_json::Value;

use super::outcome::Outcome;
use crate::repository;

/// Everything is built once, as it is shipped, so that the tests judge the program that people run. Overflow is checked
/// there, too.
/// Benchmarks are only checked, by clippy: what they are measured with takes long to build.
const CARGO_TEST: [&str; 8] =
    ["test", "--workspace", "--exclude", "agv-benches", "--release", "--features", "agv/full", "--no-fail-fast"];

/// Programs whose tests wait for networks, or run on one core: they run beside those that compute.
const WAITING: [&str; 2] = ["bad_network", "chip"];

/// Programs whose tests emulate a board in real time: they have the machine to themselves.
const EMULATED: [&str; 6] = ["vehicle", "firmware", "vehicle_on_can", "view", "service_attacks", "busy_bus"];

/// Programs that take longest: they begin first.
const LONGEST: [&str; 5] = ["place_images", "agv", "places", "evaluate", "falko"];

/// A program of tests.
#[derive(Debug, PartialEq)]
pub struct Program {
    name: String,
    executable: PathBuf,
    /// Of its crate: where its tests expect to run.
    folder: PathBuf,
}

/// Runs all tests.
pub fn run(programs: &[Program], is_long: bool) -> anyhow::Result<Outcome> {
    if programs.is_empty() {
        bail!("cargo has built no tests");
    }
    // Tests that are skipped say so here: what they print is held back by the test harness.
    let skips = std::env::temp_dir().join(format!("agv-skipped-{}", std::process::id()));
    let set_up = |command: &mut Command| {
        command.env("AGV_SKIPPED", &skips);
        if is_long {
            command.env("AGV_LONG", "1").arg("--include-ignored");
        }
    };
    let (emulated, others): (Vec<_>, Vec<_>) =
        programs.iter().partition(|program| EMULATED.contains(&program.name.as_str()));
    let (waiting, mut computing): (Vec<_>, Vec<_>) =
        others.into_iter().partition(|program| WAITING.contains(&program.name.as_str()));
    computing.sort_by_key(|program| LONGEST.iter().position(|name| *name == program.name).unwrap_or(LONGEST.len()));
    let outcome = Mutex::new(Outcome::new());
    // Takes one program after the other until none is left.
    let run_row = |row: &Mutex<VecDeque<&Program>>, threads: Option<usize>| -> anyhow::Result<()> {
        loop {
            let next = row.lock().unwrap_or_else(PoisonError::into_inner).pop_front();
            let Some(program) = next else { return Ok(()) };
            let mut command = Command::new(&program.executable);
            command.current_dir(&program.folder).env("CARGO_MANIFEST_DIR", &program.folder);
            set_up(&mut command);
            command.args(threads.map(|threads| format!("--test-threads={threads}")));
            let output = command.stdin(Stdio::null()).output();
            let output = output.with_context(|| format!("{} cannot be started", program.executable.display()))?;
            let mut outcome = outcome.lock().unwrap_or_else(PoisonError::into_inner);
            take(&mut outcome, &program.name, &output);
        }
    };
    let [waiting, computing, emulated] = [waiting, computing, emulated].map(|row| Mutex::new(VecDeque::from(row)));
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    std::thread::scope(|scope| {
        let mut rows = vec![scope.spawn(|| run_row(&waiting, None))];
        // A program of one long test would leave the other cores without work.
        rows.extend((0..cores).map(|_| scope.spawn(|| run_row(&computing, Some(1)))));
        rows.into_iter().try_for_each(|row| row.join().unwrap_or_else(|_| bail!("a row of tests broke down")))
    })?;
    run_row(&emulated, None)?;
    let mut outcome = outcome.into_inner().unwrap_or_else(PoisonError::into_inner);
    let mut examples = cargo_test();
    examples.arg("--doc").arg("--");
    set_up(&mut examples);
    take(&mut outcome, "examples in the documentation", &examples.output().context("cargo cannot be started")?);
    let lines: BTreeSet<String> =
        std::fs::read_to_string(&skips).unwrap_or_default().lines().map(str::to_owned).collect();
    outcome.skipped.extend(lines);
    let _ = std::fs::remove_file(&skips);
    Ok(outcome)
}

fn cargo_test() -> Command {
    let cargo = std::env::var_os("CARGO").map_or_else(|| PathBuf::from("cargo"), PathBuf::from);
    let mut command = Command::new(cargo);
    command.args(CARGO_TEST).current_dir(repository());
    command
}

/// Builds all tests.
pub fn build() -> anyhow::Result<Vec<Program>> {
    let mut command = cargo_test();
    command.args(["--no-run", "--message-format", "json-render-diagnostics"]).stderr(Stdio::inherit());
    let output = command.output().context("cargo cannot be started")?;
    if !output.status.success() {
        bail!("the tests cannot be built");
    }
    let messages = String::from_utf8(output.stdout).context("what cargo says is no text")?;
    Ok(messages.lines().filter_map(program_in).collect())
}

/// The program of tests that a message of cargo tells of, if it does.
fn program_in(message: &str) -> Option<Program> {
    let message: Value = serde_json::from_str(message).ok()?;
    if message["reason"] != "compiler-artifact" || message["profile"]["test"] != true {
        return None;
    }
    Some(Program {
        name: message["target"]["name"].as_str()?.to_owned(),
        executable: message["executable"].as_str()?.into(),
        folder: Path::new(message["manifest_path"].as_str()?).parent()?.to_owned(),
    })
}

/// Prints what a program has said, and counts it.
fn take(outcome: &mut Outcome, name: &str, output: &Output) {
    println!("\n     Running {name}");
    let text = String::from_utf8_lossy(&output.stdout);
    let failed = outcome.failed.len();
    for line in text.lines() {
        outcome.take(line);
        println!("{line}");
    }
    eprint!("{}", String::from_utf8_lossy(&output.stderr));
    if !output.status.success() {
        outcome.is_ok = false;
        // One that ends before its tests do names none of them.
        if outcome.failed.len() == failed {
            outcome.failed.push(format!("{name} ({})", output.status));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::process::ExitStatusExt;
    use std::process::{ExitStatus, Output};

    use super::super::outcome::Outcome;
    use super::{program_in, take};

    #[test]
    fn programs_of_tests_are_found_among_what_cargo_builds() {
        let message = |is_test: bool| {
            format!(
                r#"{{"reason":"compiler-artifact","manifest_path":"/a/core/Cargo.toml","target":{{"name":"all"}},
                "profile":{{"test":{is_test}}},"executable":"/a/target/release/deps/all-1"}}"#
            )
        };
        let program = program_in(&message(true)).unwrap();
        assert_eq!((program.name.as_str(), program.folder.to_str()), ("all", Some("/a/core")));
        assert_eq!(program_in(&message(false)), None);
        assert_eq!(program_in("running 3 tests"), None);
    }

    #[test]
    fn a_program_that_breaks_down_has_failed() {
        let mut outcome = Outcome::new();
        let stdout = b"running 2 tests\ntest a ... ok\n".to_vec();
        let output = Output { status: ExitStatus::from_raw(6), stdout, stderr: Vec::new() };
        take(&mut outcome, "all", &output);
        assert!(!outcome.is_ok);
        assert_eq!(outcome.failed.len(), 1);
        assert!(outcome.failed[0].starts_with("all ("), "{:?}", outcome.failed);
    }
}
