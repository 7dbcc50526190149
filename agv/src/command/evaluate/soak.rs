//! `agv evaluate soak`.

use std::path::PathBuf;

use agv_host_sim::simulate::scenario::Scenario;
use agv_lab::campaign::soak::{Hour, soak};
use agv_lab::evaluate::arbitrary_events::{fuzz, fuzz_seeds};
use anyhow::ensure;
use serde_json::json;

use crate::command::progress;

/// Drives for many hours in one run, and tells the localiser arbitrary events.
///
/// Ends with 1 if the program has panicked, or an output broke what must always hold.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Soak {
    /// The drive; it goes on lap after lap.
    #[arg(long, default_value = "warehouse_hall")]
    scenario: PathBuf,
    /// Hours of the drive.
    #[arg(long, default_value_t = 24, value_parser = clap::value_parser!(u64).range(1..=48))]
    hours: u64,
    /// Arbitrary events that the localiser is told.
    #[arg(long, default_value_t = 2_000_000)]
    fuzz_events: u64,
    /// One JSON object instead of the table.
    #[arg(long)]
    json: bool,
}

const HELP: &str = "\
Examples:
  agv evaluate soak
  agv evaluate soak --hours 1 --fuzz-events 100000 --json

Keys of --json: hours [hour, position_mm, heading_deg, violations, degraded_s, seconds, memory_mb], fuzzed {events, violations,
panics}.";

impl Soak {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let scenario = Scenario::read(&self.scenario)?;
        let bar = progress::bar("seeds of arbitrary events", fuzz_seeds(self.fuzz_events));
        let fuzzed = fuzz(self.fuzz_events, || bar.inc(1));
        bar.finish_and_clear();
        let bar = progress::bar("hours", self.hours);
        let hours = soak(&scenario, self.hours, || bar.inc(1))?;
        bar.finish_and_clear();
        if self.json {
            println!("{}", serde_json::to_string_pretty(&json!({ "hours": hours, "fuzzed": fuzzed }))?);
        } else {
            print_hours(&hours);
            println!(
                "\n{} arbitrary events: {} outputs broke a rule, {} panics",
                fuzzed.events, fuzzed.violations, fuzzed.panics
            );
        }
        ensure!(fuzzed.violations == 0 && fuzzed.panics == 0, "arbitrary events have broken what must always hold");
        Ok(())
    }
}

fn print_hours(hours: &[Hour]) {
    println!(
        "{:>4} {:>26} {:>9} {:>10} {:>10} {:>11} {:>10}",
        "hour", "mm median, 95 %, largest", "deg", "violations", "degraded s", "processor s", "memory MB"
    );
    for hour in hours {
        println!(
            "{:>4} {:>10.2} {:>7.2} {:>7.2} {:>9.3} {:>10} {:>10.1} {:>11.2} {:>10.1}",
            hour.hour,
            hour.position_mm.median,
            hour.position_mm.p95,
            hour.position_mm.max,
            hour.heading_deg,
            hour.violations,
            hour.degraded_s,
            hour.seconds,
            hour.memory_mb.unwrap_or(f64::NAN),
        );
    }
}
