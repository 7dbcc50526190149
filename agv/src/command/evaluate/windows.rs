//! `agv evaluate windows`.

use std::path::PathBuf;

use agv_host_sim::data;
use agv_lab::evaluate::slam::OfficeDrive;
use agv_lab::evaluate::windows::{Candidate, Worsening, drift};
use anyhow::Context;

use crate::command::progress;

const HELP: &str = "\
Examples:
  agv evaluate windows
  agv evaluate windows --length 7 --json
  agv evaluate windows --log intel-lab.log";

/// Drift on windows of a real drive through an unknown office: features and scans alone.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Windows {
    /// CARMEN log with raw odometry and corrected poses; that of fr079 if absent.
    #[arg(long)]
    log: Option<PathBuf>,
    /// Length of a window, m.
    #[arg(long, default_value_t = 12.0)]
    length: f64,
    /// Print a JSON array instead of a table.
    #[arg(long)]
    json: bool,
}

impl Windows {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        anyhow::ensure!(self.length > 0.0, "--length must be more than 0 m");
        let drive = match self.log {
            Some(log) => OfficeDrive::of_carmen(&log)?,
            None => {
                let folder = data::folder().context("set AGV_DATA to the folder of recordings")?.join("scans2d");
                OfficeDrive::of_graph(&folder.join("fr079.log"), &folder.join("freiburg-079-corrected.log.gz"))?
            }
        };
        let bar = progress::bar("driving", (Candidate::ALL.len() * Worsening::ALL.len()) as u64);
        let mut drifts = Vec::new();
        for worsening in &Worsening::ALL {
            for candidate in &Candidate::ALL {
                drifts.push(drift(&drive, self.length, candidate, worsening)?);
                bar.inc(1);
            }
        }
        bar.finish_and_clear();
        anyhow::ensure!(drifts.iter().all(|drift| drift.windows > 0), "the drive is shorter than a window");
        if self.json {
            println!("{}", serde_json::to_string_pretty(&drifts)?);
            return Ok(());
        }
        println!(
            "{:<28} {:<8} {:>7} {:>5}   {:<22} {:<22}",
            "", "odometry", "windows", "lost", "m median, 95 %, max", "deg"
        );
        for drift in &drifts {
            let (position, heading) = (drift.position_m, drift.heading_deg);
            println!(
                "{:<28} {:<8} {:>7} {:>4.0}% {:>7.3} {:>6.3} {:>6.3}   {:>7.2} {:>6.2} {:>6.2}",
                drift.candidate,
                drift.odometry,
                drift.windows,
                100.0 * drift.lost_share,
                position.median,
                position.p95,
                position.max,
                heading.median,
                heading.p95,
                heading.max
            );
        }
        Ok(())
    }
}
