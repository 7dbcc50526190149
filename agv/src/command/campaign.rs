//! `agv campaign`.

use std::path::PathBuf;

use agv_lab::campaign::results::{self, Row};
use agv_lab::campaign::table::table;
use agv_lab::campaign::{Campaign as Plan, Shard};
use anyhow::Context as _;

use crate::command::output::check_files;
use crate::command::progress;

/// Let things go wrong in simulated drives, through the controller's wire code, and say how it takes them.
///
/// Each fault is there alone, with as many seeds as the file says; with --pairs every two of them, each pair with one seed.
/// The same campaign gives the same table on every machine, however it is cut into shards.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Campaign {
    /// The campaign, a file or `faults`, which comes with the program; or tables of results, to put together.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Every two faults together instead of each alone.
    #[arg(long)]
    pairs: bool,
    /// Seeds of each fault, instead of what the file says.
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..))]
    runs: Option<u64>,
    /// First seed. Thresholds were chosen on the seeds 1 to 25.
    #[arg(long)]
    first_seed: Option<u64>,
    /// Only faults whose name contains this.
    #[arg(long, default_value = "")]
    only: String,
    /// Only a part of the runs: 2/4 is the third of four.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Write every run, as Apache Parquet.
    #[arg(long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// One JSON array with an object a run, instead of the table.
    #[arg(long)]
    json: bool,
}

const HELP: &str = "\
Examples:
  agv campaign faults
  agv campaign faults --only laser --runs 5
  agv campaign faults --shard 0/2 --output 0.parquet
  agv campaign 0.parquet 1.parquet";

impl Campaign {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        check_files(&self.output)?;
        if self.output.is_some() {
            results::TABLES.check()?;
        }
        let is_table = |file: &PathBuf| file.extension().is_some_and(|extension| extension == "parquet");
        let mut rows = if self.files.iter().all(is_table) {
            let mut rows = Vec::new();
            for file in &self.files {
                rows.extend(results::read(file)?);
            }
            rows
        } else {
            self.make()?
        };
        rows.sort_by_key(|row| row.run);
        if let Some(output) = &self.output {
            results::write(output, &rows)?;
        }
        if self.json {
            println!("{}", serde_json::to_string_pretty(&rows)?);
        } else {
            print!("{}", table(&rows));
        }
        Ok(())
    }

    fn make(&self) -> anyhow::Result<Vec<Row>> {
        let [file] = &self.files[..] else { anyhow::bail!("one campaign at a time, or tables of results (.parquet)") };
        let (mut plan, scenario) = Plan::read(file).with_context(|| file.display().to_string())?;
        plan.runs = self.runs.unwrap_or(plan.runs);
        plan.first_seed = self.first_seed.unwrap_or(plan.first_seed);
        let mut runs = if self.pairs { plan.pairs() } else { plan.alone() };
        runs.retain(|run| run.faults.iter().any(|&fault| plan.faults[fault].name.contains(&self.only)));
        anyhow::ensure!(!runs.is_empty(), "no fault has such a name");
        let shard = self.shard.unwrap_or(Shard::ALL);
        let progress = progress::bar("runs", (0..runs.len()).filter(|run| shard.has(*run)).count() as u64);
        let rows = plan.rows(&scenario, &runs, shard, || progress.inc(1))?;
        progress.finish_and_clear();
        Ok(rows)
    }
}
