//! `agv evaluate windows`.

use std::path::PathBuf;

use agv_lab::evaluate::windows::{Candidate, Worsening, contour_drift, drift, vehicle_drift};

use super::office_drive::DriveChoice;
use super::trajectory;
use crate::command::output::check_files;
use crate::command::progress;

const HELP: &str = "\
Examples:
  agv evaluate windows
  agv evaluate windows --length 7 --json
  agv evaluate windows --set aces
  agv evaluate windows --log drive.log --trajectory poses.csv

The file of --trajectory has the lines window,scan,x,y,theta: the poses by contours with the raw odometry.";

/// Drift on windows of a real drive through an unknown office: features and scans alone.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Windows {
    #[command(flatten)]
    drive: DriveChoice,
    /// Write the poses by contours to a file; an older one is replaced.
    #[arg(long, value_name = "CSV")]
    trajectory: Option<PathBuf>,
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
        check_files(&self.trajectory)?;
        anyhow::ensure!(self.length > 0.0, "--length must be more than 0 m");
        let drive = self.drive.read()?;
        let bar = progress::bar("driving", ((Candidate::ALL.len() + 2) * Worsening::ALL.len()) as u64);
        let mut drifts = Vec::new();
        for worsening in &Worsening::ALL {
            for candidate in &Candidate::ALL {
                drifts.push(drift(&drive, self.length, candidate, worsening)?);
                bar.inc(1);
            }
            drifts.push(vehicle_drift(&drive, self.length, worsening)?);
            bar.inc(1);
            let (by_contours, poses) = contour_drift(&drive, self.length, worsening);
            drifts.push(by_contours);
            bar.inc(1);
            if let Some(path) = self.trajectory.as_ref().filter(|_| worsening.is_raw()) {
                trajectory::write(path, &poses)?;
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
