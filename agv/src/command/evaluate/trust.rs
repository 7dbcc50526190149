//! `agv evaluate trust`.

use std::path::PathBuf;

use agv_lab::campaign::soak::{Hour, soak};
use agv_lab::campaign::table::table;
use agv_lab::campaign::{Campaign, Shard};
use agv_lab::evaluate::trust::{figures, fuzz, fuzz_seeds};
use anyhow::Context as _;

use crate::command::progress;

/// What happens when things go wrong: faults alone and in pairs, a drive of many hours, and arbitrary events.
///
/// The chapter "Trust" of the book explains each figure. All of it takes some minutes.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Trust {
    /// The campaign.
    #[arg(long, default_value = "host-sim/scenarios/faults.toml")]
    campaign: PathBuf,
    /// Seeds of each fault alone, instead of what the campaign says.
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..))]
    runs: Option<u64>,
    /// First seed. Thresholds were chosen on the seeds 1 to 25.
    #[arg(long)]
    first_seed: Option<u64>,
    /// Leave out the pairs of faults.
    #[arg(long)]
    without_pairs: bool,
    /// Hours of the long drive.
    #[arg(long, default_value_t = 24, value_parser = clap::value_parser!(u64).range(1..=48))]
    soak_hours: u64,
    /// Arbitrary events that the localiser is told.
    #[arg(long, default_value_t = 2_000_000)]
    fuzz_events: u64,
    /// One JSON object instead of the tables.
    #[arg(long)]
    json: bool,
}

const HELP: &str = "\
Examples:
  agv evaluate trust
  agv evaluate trust --runs 2 --without-pairs --soak-hours 1 --fuzz-events 100000 --json";

impl Trust {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let (mut plan, scenario) =
            Campaign::read(&self.campaign).with_context(|| self.campaign.display().to_string())?;
        plan.runs = self.runs.unwrap_or(plan.runs);
        plan.first_seed = self.first_seed.unwrap_or(plan.first_seed);
        let alone = plan.alone();
        let pairs = if self.without_pairs { Vec::new() } else { plan.pairs() };
        let bar = progress::bar("runs", (alone.len() + pairs.len()) as u64);
        let mut rows = plan.rows(&scenario, &alone, Shard::ALL, || bar.inc(1))?;
        rows.extend(plan.rows(&scenario, &pairs, Shard::ALL, || bar.inc(1))?);
        bar.finish_and_clear();
        let bar = progress::bar("seeds of arbitrary events", fuzz_seeds(self.fuzz_events));
        let fuzzed = fuzz(self.fuzz_events, || bar.inc(1));
        bar.finish_and_clear();
        let bar = progress::bar("hours", self.soak_hours);
        let hours = soak(&scenario, self.soak_hours, || bar.inc(1))?;
        bar.finish_and_clear();
        let trust = figures(plan.faults.len(), &rows, &hours, &fuzzed);
        if self.json {
            println!("{}", serde_json::to_string_pretty(&trust)?);
            return Ok(());
        }
        print!("{}", table(&rows));
        print_hours(&hours);
        println!("\n{}", serde_json::to_string_pretty(&trust)?);
        Ok(())
    }
}

fn print_hours(hours: &[Hour]) {
    println!(
        "\n{:>4} {:>26} {:>9} {:>10} {:>10} {:>11} {:>10}",
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
