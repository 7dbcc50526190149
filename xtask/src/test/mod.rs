//! `cargo xtask test`.

mod outcome;
mod programs;

use std::time::Instant;

use anyhow::{anyhow, bail};

use crate::fuzz::Fuzz;
use crate::{firmware, requirements};

/// Run all tests.
#[derive(clap::Args)]
pub struct Test {
    /// More seeds and longer drives: sets `AGV_LONG` for the tests. Makes those too that take a minute of real time, and
    /// runs every fuzz target for a minute.
    #[arg(long)]
    long: bool,
}

impl Test {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let is_complete = std::env::var_os("CI").is_some_and(|value| value == "true");
        let start = Instant::now();
        // What is downloaded, what is linked for boards and what is compiled for this machine hardly wait for each other.
        let (missing, programs) = std::thread::scope(|scope| {
            let missing = scope.spawn(requirements::prepare);
            // The tests in emulation run these images.
            let images = scope.spawn(|| firmware::build().and_then(|()| firmware::check_sizes()));
            let programs = programs::build();
            let missing = missing.join().map_err(|_| anyhow!("what installs the requirements broke down"))?;
            images.join().map_err(|_| anyhow!("what builds the firmware broke down"))??;
            anyhow::Ok((missing, programs?))
        })?;
        if is_complete && !missing.is_empty() {
            bail!("not everything that the tests need can be had here:\n{}", missing.join("\n"));
        }
        let built = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let outcome = programs::run(&programs, self.long)?;
        println!("\nbuilding {built:.0} s, tests {:.0} s", start.elapsed().as_secs_f64());
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
}
