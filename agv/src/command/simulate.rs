//! `agv simulate`.

use std::path::PathBuf;

use agv_host_sim::log;
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::{simulate, standard};

use super::output::note;
use super::summary::Summary;

const HELP: &str = "\
Examples:
  agv simulate block_storage_p1 --output drive.agvlog
  agv simulate warehouse_hall --show > mine.toml
  agv simulate warehouse_hall --seed 7 --output hall.agvlog --json

Scenarios that come with the program: block_storage_mapping, block_storage_p1 to block_storage_p4, people, warehouse_hall.";

/// Simulate a drive: a world, a vehicle, its encoders and its laser.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Simulate {
    /// Scenario: a file, or the name of one that comes with the program.
    scenario: PathBuf,
    /// Seed of all random numbers, instead of the scenario's.
    #[arg(long)]
    seed: Option<u64>,
    /// Log to write; an older one is replaced.
    #[arg(short, long, value_name = "LOG")]
    output: Option<PathBuf>,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
    /// Print the scenario's text instead, to begin one's own with.
    #[arg(long, conflicts_with_all = ["seed", "output", "json"])]
    show: bool,
}

impl Simulate {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let mut scenario = Scenario::read(&self.scenario)?;
        if self.show {
            println!("{}", standard::read_to_string(&self.scenario)?.trim_end());
            return Ok(());
        }
        scenario.seed = self.seed.unwrap_or(scenario.seed);
        note(&format!("simulating {} with seed {}", self.scenario.display(), scenario.seed));
        let recording = simulate(&scenario)?.recording;
        if let Some(path) = &self.output {
            log::write(path, &recording)?;
        }
        Summary::of(&recording).print(self.json)
    }
}
