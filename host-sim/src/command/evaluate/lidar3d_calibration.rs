//! `agv evaluate lidar3d-calibration`.

use agv_host_sim::data;
use agv_host_sim::evaluate::lidar3d_calibration;
use agv_lidar3d::calibration::Calibration;
use anyhow::Context;

/// How well the intrinsic calibration of a multi-beam lidar finds disturbed parameters back. Prints a JSON array.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  agv evaluate lidar3d-calibration --json\n  agv evaluate lidar3d-calibration --seed 7 --json"
)]
pub struct Lidar3dCalibration {
    /// Seed of disturbance and noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Print a JSON array instead of a line a file.
    #[arg(long)]
    json: bool,
}

impl Lidar3dCalibration {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let folder = data::folder().context("there is no folder of real data (AGV_DATA)")?.join("lidar3d/calib");
        let mut outcomes = Vec::new();
        let mut files: Vec<_> = std::fs::read_dir(&folder)?.filter_map(|entry| Some(entry.ok()?.path())).collect();
        files.sort();
        for path in files {
            let text = std::fs::read_to_string(&path)?;
            // Files of other sensors, and of other formats, are not part of the experiment.
            let Ok(calibration) = Calibration::read(&text).and_then(|found| found.for_lasers(64)) else { continue };
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            outcomes.push(lidar3d_calibration::run(&name, &calibration.lasers, self.seed)?);
        }
        if self.json {
            println!("{}", serde_json::to_string_pretty(&outcomes)?);
            return Ok(());
        }
        for outcome in outcomes {
            println!("{outcome:?}");
        }
        Ok(())
    }
}
