//! `agv evaluate`.

mod falko;

/// Measure on recordings or in simulation what the parts achieve.
#[derive(clap::Args)]
pub struct Evaluate {
    #[command(subcommand)]
    experiment: Experiment,
}

#[derive(clap::Subcommand)]
enum Experiment {
    Falko(falko::Falko),
}

impl Evaluate {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        match self.experiment {
            Experiment::Falko(falko) => falko.run(),
        }
    }
}
