//! `agv evaluate falko`.

use agv_lab::evaluate::falko;

/// Keypoints on the office logs of the thesis: number, repeatability, time, and agreement with the reference program.
#[derive(clap::Args)]
pub struct Falko {
    /// Log to measure on.
    #[arg(long)]
    set: super::Set,
    /// Print a JSON array instead of a table.
    #[arg(long)]
    json: bool,
}

impl Falko {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let outcomes = falko::run(self.set.into())?;
        if self.json {
            println!("{}", serde_json::to_string_pretty(&outcomes)?);
            return Ok(());
        }
        println!("profile    keypoints/scan  reference  repeatability  counting empty  us/scan");
        for outcome in outcomes {
            println!(
                "{:<10} {:>14.1} {:>9.1}% {:>14.3} {:>15.3} {:>8.1}",
                outcome.profile,
                outcome.keypoints_per_scan,
                100.0 * outcome.reference_match,
                outcome.repeatability.unwrap_or(f64::NAN),
                outcome.repeatability_counting_empty.unwrap_or(f64::NAN),
                outcome.us_per_scan
            );
        }
        Ok(())
    }
}
