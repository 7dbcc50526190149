//! `agv evaluate halting-points`.

use agv_lab::evaluate::halting_points;

use super::super::progress;

const HELP: &str = "\
Examples:
  agv evaluate halting-points
  agv evaluate halting-points --trials 20 --seed 7 --json";

/// Four simulated vehicles drive to ten points, each by its own estimate, after calibration by hand and from a drive.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct HaltingPoints {
    /// How often all vehicles are calibrated and drive to all points.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    trials: u32,
    /// First seed.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// One JSON array instead of a table.
    #[arg(long)]
    json: bool,
}

impl HaltingPoints {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let bar = progress::bar("driving", 3 * u64::from(self.trials));
        let outcomes = halting_points::run(self.trials, self.seed, || bar.inc(1))?;
        bar.finish_and_clear();
        if self.json {
            println!("{}", serde_json::to_string_pretty(&outcomes)?);
            return Ok(());
        }
        println!(
            "{:<12} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8}   mm",
            "calibration", "R32", "R30", "R31", "R36", "mean", "largest", "target"
        );
        for outcome in &outcomes {
            print!("{:<12}", format!("{:?}", outcome.calibration).to_lowercase());
            for vehicle in &outcome.vehicles {
                print!(" {:>8.2}", vehicle.mean_distance_mm);
            }
            println!(
                " {:>8.2} {:>8.2} {:>8.2}",
                outcome.mean_distance_mm, outcome.largest_distance_mm, outcome.mean_error_mm
            );
        }
        Ok(())
    }
}
