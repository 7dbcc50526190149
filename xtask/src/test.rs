//! `cargo xtask test`.

use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::{Context, bail};

use crate::fuzz::Fuzz;
use crate::{firmware, packages, repository};

/// Run all tests.
#[derive(clap::Args)]
pub struct Test {
    /// More seeds and longer drives: sets `AGV_LONG` for the tests. Runs every fuzz target for a minute.
    #[arg(long)]
    long: bool,
}

/// A part of the tests.
struct Part {
    name: &'static str,
    arguments: &'static [&'static str],
}

/// The parts that show single rooms are built with overflow checks; what drives whole vehicles is built for speed.
const PARTS: [Part; 2] = [
    Part { name: "crates", arguments: &["test", "--workspace", "--exclude", "agv-tests"] },
    Part { name: "whole drives", arguments: &["test", "--package", "agv-tests", "--release"] },
];

/// How a part ended.
struct Outcome {
    is_ok: bool,
    passed: usize,
    failed: Vec<String>,
    skipped: Vec<String>,
}

impl Test {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let mut missing = packages::prepare();
        missing.extend(packages::prepare_python(&repository().join("target/python")));
        missing.extend(packages::prepare_node(&repository().join("target/node")));
        // The tests in emulation run these images.
        firmware::build()?;
        firmware::check_sizes()?;
        let mut summary = Vec::new();
        let mut remarks = missing;
        let mut is_ok = true;
        for part in &PARTS {
            let start = Instant::now();
            let outcome = self.run_part(part)?;
            let verdict = if outcome.is_ok { "ok" } else { "FAILED" };
            summary.push(format!(
                "{:<14} {verdict:<7} {:>5} passed {:>4} failed {:>6.0} s",
                part.name,
                outcome.passed,
                outcome.failed.len(),
                start.elapsed().as_secs_f64()
            ));
            remarks.extend(outcome.failed.into_iter().map(|name| format!("failed: {name}")));
            remarks.extend(outcome.skipped);
            is_ok &= outcome.is_ok;
        }
        println!();
        for line in summary.iter().chain(&remarks) {
            println!("{line}");
        }
        if !is_ok {
            bail!("the tests failed");
        }
        println!("all tests passed");
        if self.long { Fuzz::all(60).run() } else { Ok(()) }
    }

    fn run_part(&self, part: &Part) -> anyhow::Result<Outcome> {
        let cargo = std::env::var_os("CARGO").map_or_else(|| PathBuf::from("cargo"), PathBuf::from);
        let mut command = Command::new(cargo);
        command.args(part.arguments).arg("--no-fail-fast").current_dir(repository()).stdout(Stdio::piped());
        if self.long {
            command.env("AGV_LONG", "1");
        }
        // Tests that are skipped say so here: what they print is held back by the test harness.
        let skips = std::env::temp_dir().join(format!("agv-skipped-{}", std::process::id()));
        command.env("AGV_SKIPPED", &skips);
        let mut child = command.spawn().context("cargo cannot be started")?;
        let mut outcome = Outcome { is_ok: false, passed: 0, failed: Vec::new(), skipped: Vec::new() };
        if let Some(output) = child.stdout.take() {
            for line in BufReader::new(output).lines() {
                let line = line.context("the output of cargo cannot be read")?;
                outcome.take(&line);
                println!("{line}");
            }
        }
        outcome.is_ok = child.wait().context("cargo has vanished")?.success();
        let lines = std::fs::read_to_string(&skips).unwrap_or_default();
        outcome.skipped = lines.lines().map(str::to_owned).collect();
        outcome.skipped.sort();
        let _ = std::fs::remove_file(&skips);
        Ok(outcome)
    }
}

impl Outcome {
    fn take(&mut self, line: &str) {
        let Some(rest) = line.strip_prefix("test ") else { return };
        if let Some(counts) = rest.strip_prefix("result: ") {
            let passed = counts.split([' ', ';']).collect::<Vec<_>>();
            let number = passed.windows(2).find(|pair| pair[1] == "passed").and_then(|pair| pair[0].parse().ok());
            self.passed += number.unwrap_or(0);
        } else if let Some(name) = rest.strip_suffix(" ... FAILED") {
            self.failed.push(name.to_owned());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Outcome;

    #[test]
    fn results_are_counted() {
        let mut outcome = Outcome { is_ok: false, passed: 0, failed: Vec::new(), skipped: Vec::new() };
        for line in [
            "running 3 tests",
            "test a::b ... ok",
            "test a::c ... FAILED",
            "test result: FAILED. 12 passed; 1 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.01s",
            "test result: ok. 5 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.01s",
        ] {
            outcome.take(line);
        }
        assert_eq!((outcome.passed, outcome.failed), (17, vec!["a::c".to_owned()]));
    }
}
