//! `cargo xtask test`.

use std::collections::BTreeSet;
use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::{Context, bail};

use crate::fuzz::Fuzz;
use crate::{firmware, repository, requirements};

/// Run all tests.
#[derive(clap::Args)]
pub struct Test {
    /// More seeds and longer drives: sets `AGV_LONG` for the tests. Makes those too that take a minute of real time, and
    /// runs every fuzz target for a minute.
    #[arg(long)]
    long: bool,
}

/// Everything is built once, as it is shipped, so that the tests judge the program that people run. Overflow is checked
/// there, too.
const CARGO_TEST: [&str; 6] = ["test", "--workspace", "--release", "--features", "agv-host-sim/full", "--no-fail-fast"];

/// How the tests ended.
#[derive(Debug, Default)]
struct Outcome {
    is_ok: bool,
    passed: usize,
    ignored: usize,
    failed: Vec<String>,
    /// A line for each thing that a test was skipped for: the name of the test stands before a comma.
    skipped: Vec<String>,
}

impl Test {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let is_complete = std::env::var_os("CI").is_some_and(|value| value == "true");
        let missing = requirements::prepare();
        if is_complete && !missing.is_empty() {
            bail!("not everything that the tests need can be had here:\n{}", missing.join("\n"));
        }
        let start = Instant::now();
        // The tests in emulation run these images.
        firmware::build()?;
        firmware::check_sizes()?;
        let built = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let outcome = self.run_tests()?;
        println!("\nfirmware {built:.0} s, tests {:.0} s", start.elapsed().as_secs_f64());
        for line in missing.iter().chain(&outcome.skipped) {
            println!("{line}");
        }
        for name in &outcome.failed {
            println!("failed: {name}");
        }
        println!("{}", outcome.last_line());
        if !outcome.is_ok {
            bail!("the tests failed");
        }
        if self.long { Fuzz::all(60).run() } else { Ok(()) }
    }

    fn run_tests(&self) -> anyhow::Result<Outcome> {
        let cargo = std::env::var_os("CARGO").map_or_else(|| PathBuf::from("cargo"), PathBuf::from);
        let mut command = Command::new(cargo);
        command.args(CARGO_TEST).current_dir(repository()).stdout(Stdio::piped());
        if self.long {
            command.env("AGV_LONG", "1").args(["--", "--include-ignored"]);
        }
        // Tests that are skipped say so here: what they print is held back by the test harness.
        let skips = std::env::temp_dir().join(format!("agv-skipped-{}", std::process::id()));
        command.env("AGV_SKIPPED", &skips);
        let mut child = command.spawn().context("cargo cannot be started")?;
        let mut outcome = Outcome::default();
        if let Some(output) = child.stdout.take() {
            for line in BufReader::new(output).lines() {
                let line = line.context("the output of cargo cannot be read")?;
                outcome.take(&line);
                println!("{line}");
            }
        }
        outcome.is_ok = child.wait().context("cargo has vanished")?.success();
        let lines: BTreeSet<String> =
            std::fs::read_to_string(&skips).unwrap_or_default().lines().map(str::to_owned).collect();
        outcome.skipped.extend(lines);
        let _ = std::fs::remove_file(&skips);
        Ok(outcome)
    }
}

impl Outcome {
    fn take(&mut self, line: &str) {
        let Some(rest) = line.strip_prefix("test ") else { return };
        if let Some(counts) = rest.strip_prefix("result: ") {
            let words = counts.split([' ', ';']).collect::<Vec<_>>();
            let count = |what: &str| {
                let pair = words.windows(2).find(|pair| pair[1] == what);
                pair.and_then(|pair| pair[0].parse::<usize>().ok()).unwrap_or(0)
            };
            self.passed += count("passed");
            self.ignored += count("ignored");
        } else if let Some(name) = rest.strip_suffix(" ... FAILED") {
            self.failed.push(name.to_owned());
        }
    }

    /// The tests that were skipped: the test harness counts them as passed.
    fn skipped_tests(&self) -> BTreeSet<&str> {
        let named = self.skipped.iter().filter_map(|line| line.strip_prefix("skipped: ")?.split(", because ").next());
        named.collect()
    }

    fn last_line(&self) -> String {
        let skipped = self.skipped_tests();
        let passed = self.passed.saturating_sub(skipped.len());
        let counts = format!("{passed} passed, {} failed, {} skipped", self.failed.len(), skipped.len());
        let left = match self.ignored {
            0 => String::new(),
            ignored => format!("; {ignored} are left for --long"),
        };
        let verdict = match (self.is_ok, skipped.is_empty()) {
            (false, _) => "FAILED".to_owned(),
            (true, true) => "all tests passed".to_owned(),
            (true, false) => {
                let names: Vec<&str> = skipped.into_iter().collect();
                format!("passed, but {} skipped: {}", names.len(), names.join(", "))
            }
        };
        format!("{counts}{left}\n{verdict}")
    }
}

#[cfg(test)]
mod tests {
    use super::Outcome;

    fn outcome() -> Outcome {
        let mut outcome = Outcome { is_ok: true, ..Outcome::default() };
        for line in [
            "running 3 tests",
            "test a::b ... ok",
            "test result: ok. 12 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out; finished in 0.01s",
            "test result: ok. 5 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.01s",
        ] {
            outcome.take(line);
        }
        outcome
    }

    #[test]
    fn results_are_counted() {
        let mut outcome = outcome();
        assert_eq!((outcome.passed, outcome.ignored), (17, 1));
        assert_eq!(outcome.last_line(), "17 passed, 0 failed, 0 skipped; 1 are left for --long\nall tests passed");
        outcome.take("test a::c ... FAILED");
        outcome.is_ok = false;
        assert_eq!(outcome.failed, ["a::c"]);
        assert!(outcome.last_line().ends_with("\nFAILED"));
    }

    #[test]
    fn what_was_skipped_did_not_pass() {
        let mut outcome = outcome();
        for why in ["there is no a", "there is no b"] {
            outcome.skipped.push(format!("skipped: d, because {why}"));
        }
        outcome.skipped.push("skipped: e, because there is no a".to_owned());
        let line = outcome.last_line();
        assert!(line.starts_with("15 passed, 0 failed, 2 skipped"), "{line}");
        assert!(line.ends_with("\npassed, but 2 skipped: d, e"), "{line}");
    }
}
