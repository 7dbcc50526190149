//! `agv simulate`.

use std::path::PathBuf;

use agv_host_sim::log;
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::simulate;

use super::output::note;
use super::summary::Summary;

const HELP: &str = "\
Examples:
  agv simulate host-sim/scenarios/block_storage_p1.toml --output drive.agvlog
  agv simulate host-sim/scenarios/warehouse_hall.toml --seed 7 --output hall.agvlog --json";

/// Simulate a drive: a world, a vehicle, its encoders and its laser.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Simulate {
    /// Scenario file; see host-sim/scenarios.
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
}

impl Simulate {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let mut scenario = Scenario::read(&self.scenario)?;
        scenario.seed = self.seed.unwrap_or(scenario.seed);
        note(&format!("simulating {} with seed {}", self.scenario.display(), scenario.seed));
        let recording = simulate(&scenario)?.recording;
        if let Some(path) = &self.output {
            log::write(path, &recording)?;
        }
        Summary::of(&recording).print(self.json)
    }
}
