//! `agv evaluate`.

mod carpark;
mod falko;
mod lidar3d_calibration;
mod lidar3d_places;
mod warehouse;

/// Measure on recordings and in simulation how good it is.
#[derive(clap::Args)]
pub struct Evaluate {
    #[command(subcommand)]
    experiment: Experiment,
}

#[derive(clap::Subcommand)]
enum Experiment {
    Carpark(carpark::Carpark),
    Falko(falko::Falko),
    Lidar3dCalibration(lidar3d_calibration::Lidar3dCalibration),
    Lidar3dPlaces(lidar3d_places::Lidar3dPlaces),
    Warehouse(warehouse::Warehouse),
}

impl Evaluate {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        match self.experiment {
            Experiment::Carpark(experiment) => experiment.run(),
            Experiment::Falko(experiment) => experiment.run(),
            Experiment::Lidar3dCalibration(experiment) => experiment.run(),
            Experiment::Lidar3dPlaces(experiment) => experiment.run(),
            Experiment::Warehouse(experiment) => experiment.run(),
        }
    }
}
