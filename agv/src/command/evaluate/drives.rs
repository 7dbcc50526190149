//! `agv evaluate drives`.

use std::path::PathBuf;

use agv_lab::evaluate::drives::drive;
use agv_lab::evaluate::slam::OfficeDrive;
use anyhow::Context;
use clap::ValueEnum;

use super::office_drive::DriveSet;
use crate::command::progress;

const HELP: &str = "\
Examples:
  agv evaluate drives
  agv evaluate drives --set aces --json
  agv evaluate drives --log drive.log --json

Keys of --json: an array of set, mode, distance_m, error_percent, error_deg_per_m (over pieces of 20 m), mean_error_m,
max_error_m (after the best rigid fit), loops, false_loops (wrong by more than 0.5 m or 10 degrees).";

/// Whole drives through real buildings, by the vehicle alone and by the map that is made of them.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Drives {
    /// CARMEN log with raw odometry and corrected poses, instead of the recordings in the folder of AGV_DATA.
    #[arg(long, conflicts_with = "set")]
    log: Option<PathBuf>,
    /// One of these recordings; all of them if absent.
    #[arg(long)]
    set: Option<DriveSet>,
    /// Print a JSON array instead of a table.
    #[arg(long)]
    json: bool,
}

impl Drives {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let logs: Vec<(String, PathBuf)> = match (self.log, self.set) {
            (Some(log), _) => vec![(log.display().to_string(), log)],
            (None, Some(set)) => vec![set.log()?],
            (None, None) => DriveSet::value_variants().iter().map(|set| set.log()).collect::<Result<_, _>>()?,
        };
        let bar = progress::bar("driving", 0);
        let mut found = Vec::new();
        for (name, log) in logs {
            found.extend(drive(&name, &OfficeDrive::of_carmen(&log)?, || bar.inc(1)).context(name)?);
        }
        bar.finish_and_clear();
        if self.json {
            println!("{}", serde_json::to_string_pretty(&found)?);
            return Ok(());
        }
        println!("set           mode                  way, m  error, %  deg/m   mean, m   most, m  loops  false");
        for of in &found {
            println!(
                "{:<13} {:<20} {:>7.0} {:>9.2} {:>6.3} {:>9.3} {:>9.3} {:>6} {:>6}",
                of.set,
                of.mode,
                of.distance_m,
                of.error_percent,
                of.error_deg_per_m,
                of.mean_error_m,
                of.max_error_m,
                of.loops,
                of.false_loops
            );
        }
        Ok(())
    }
}
