//! `agv evaluate`.

mod calibration;
mod carpark;
mod falko;
mod halting_points;
mod warehouse;

/// Measure on recordings and in simulation how good it is.
#[derive(clap::Args)]
pub struct Evaluate {
    #[command(subcommand)]
    experiment: Experiment,
}

#[derive(clap::Subcommand)]
enum Experiment {
    Calibration(calibration::Calibration),
    Carpark(carpark::Carpark),
    Falko(falko::Falko),
    HaltingPoints(halting_points::HaltingPoints),
    Warehouse(warehouse::Warehouse),
}

impl Evaluate {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        match self.experiment {
            Experiment::Calibration(experiment) => experiment.run(),
            Experiment::Carpark(experiment) => experiment.run(),
            Experiment::Falko(experiment) => experiment.run(),
            Experiment::HaltingPoints(experiment) => experiment.run(),
            Experiment::Warehouse(experiment) => experiment.run(),
        }
    }
}
