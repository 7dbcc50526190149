//! `agv evaluate calibration`.

use agv_host_sim::data;
use agv_host_sim::evaluate::calibration::sapienza;
use anyhow::Context;

/// Calibration: on a real tricycle, or in simulation.
#[derive(clap::Args)]
pub struct Calibration {
    /// Which drives.
    #[arg(long, value_enum)]
    set: Set,
    /// One JSON array instead of a table.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Set {
    /// The tricycle of the Sapienza University.
    Sapienza,
}

impl Calibration {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        match self.set {
            Set::Sapienza => self.sapienza(),
        }
    }

    fn sapienza(&self) -> anyhow::Result<()> {
        let folder = data::folder().context("the recordings are not there: set AGV_DATA to their folder")?;
        let outcomes = sapienza::run(&folder.join("sapienza_tricycle"))?;
        if self.json {
            println!("{}", serde_json::to_string_pretty(&outcomes)?);
            return Ok(());
        }
        println!(
            "{:<14} {:<17} {:>8} {:>8} {:>7} {:>7} {:>7} {:>8} {:>8}   quarters, m",
            "method", "fitted on", "F rad", "B rad", "L m", "x m", "y m", "ATE m", "deg"
        );
        for outcome in outcomes {
            println!(
                "{:<14} {:<17} {:>8.4} {:>8.4} {:>7.3} {:>7.3} {:>7.3} {:>8.3} {:>8.2}   {:.3?}",
                outcome.method,
                outcome.fitted_on,
                outcome.steer_offset_forward_rad,
                outcome.steer_offset_backward_rad,
                outcome.wheelbase_m,
                outcome.laser_x_m,
                outcome.laser_y_m,
                outcome.ate_rmse_m,
                outcome.heading_rmse_deg,
                outcome.quarters_ate_rmse_m,
            );
        }
        Ok(())
    }
}
