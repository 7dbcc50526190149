//! `agv evaluate`.

mod warehouse;

use clap::Subcommand;

/// Measure how good it is.
#[derive(clap::Args)]
pub struct Evaluate {
    #[command(subcommand)]
    experiment: Experiment,
}

#[derive(Subcommand)]
enum Experiment {
    Warehouse(warehouse::Warehouse),
}

impl Evaluate {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        match self.experiment {
            Experiment::Warehouse(experiment) => experiment.run(),
        }
    }
}
