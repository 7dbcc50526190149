//! `agv evaluate`.

mod arguments;
mod calibration;
mod carpark;
mod cloud_drive;
mod contour_drives;
mod contour_map;
mod contour_starts;
mod drives;
mod falko;
mod features;
mod gyro;
mod halting_points;
mod kidnapping;
mod levels;
mod lidar3d_calibration;
mod lidar3d_places;
mod lidar3d_sharpness;
mod office_drive;
mod places;
mod slam;
mod soak;
mod tested_arguments;
mod trajectory;
mod trial;
mod trust;
mod warehouse;
mod windows;

pub use lidar3d_places::Lidar3dPlaces;
pub use places::Places;

/// A log of the thesis.
#[derive(Clone, Copy, clap::ValueEnum)]
enum Set {
    Fr079,
    Intel,
}

impl From<Set> for agv_lab::evaluate::falko::Set {
    fn from(set: Set) -> Self {
        match set {
            Set::Fr079 => Self::Fr079,
            Set::Intel => Self::Intel,
        }
    }
}

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
    CloudDrive(cloud_drive::CloudDrive),
    ContourDrives(contour_drives::ContourDrives),
    ContourMap(contour_map::ContourMap),
    ContourStarts(contour_starts::ContourStarts),
    Drives(drives::Drives),
    Falko(falko::Falko),
    HaltingPoints(halting_points::HaltingPoints),
    Features(features::Features),
    Gyro(gyro::Gyro),
    Kidnapping(kidnapping::Kidnapping),
    Levels(levels::Levels),
    Places(places::Places),
    Slam(slam::Slam),
    Soak(soak::Soak),
    Trial(trial::TrialArguments),
    Trust(trust::Trust),
    Lidar3dCalibration(lidar3d_calibration::Lidar3dCalibration),
    Lidar3dPlaces(lidar3d_places::Lidar3dPlaces),
    Lidar3dSharpness(lidar3d_sharpness::Lidar3dSharpness),
    Warehouse(warehouse::Warehouse),
    Windows(windows::Windows),
}

impl Evaluate {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        match self.experiment {
            Experiment::Calibration(experiment) => experiment.run(),
            Experiment::Carpark(experiment) => experiment.run(),
            Experiment::CloudDrive(experiment) => experiment.run(),
            Experiment::ContourDrives(experiment) => experiment.run(),
            Experiment::ContourMap(experiment) => experiment.run(),
            Experiment::ContourStarts(experiment) => experiment.run(),
            Experiment::Drives(experiment) => experiment.run(),
            Experiment::Falko(experiment) => experiment.run(),
            Experiment::HaltingPoints(experiment) => experiment.run(),
            Experiment::Features(experiment) => experiment.run(),
            Experiment::Gyro(experiment) => experiment.run(),
            Experiment::Kidnapping(experiment) => experiment.run(),
            Experiment::Levels(experiment) => experiment.run(),
            Experiment::Places(experiment) => experiment.run(),
            Experiment::Slam(experiment) => experiment.run(),
            Experiment::Soak(experiment) => experiment.run(),
            Experiment::Trial(experiment) => experiment.run(),
            Experiment::Trust(experiment) => experiment.run(),
            Experiment::Lidar3dCalibration(experiment) => experiment.run(),
            Experiment::Lidar3dPlaces(experiment) => experiment.run(),
            Experiment::Lidar3dSharpness(experiment) => experiment.run(),
            Experiment::Warehouse(experiment) => experiment.run(),
            Experiment::Windows(experiment) => experiment.run(),
        }
    }
}
