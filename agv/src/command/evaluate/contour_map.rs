//! `agv evaluate contour-map`.

use std::path::PathBuf;

use agv_host_sim::mapping::contour_mapper::CELL;
use agv_lab::evaluate::contour_map::{Localised, localise};

use super::office_drive::DriveChoice;
use super::trajectory;
use crate::command::output::check_files;
use crate::command::progress;

const HELP: &str = "\
Examples:
  agv evaluate contour-map --set aces
  agv evaluate contour-map --log drive.log --json --trajectory poses.csv

Keys of --json: an array of method, windows, lost_share, mi_share (poses further off than their protection level),
position_m and heading_deg {median, p95, max}.
The file of --trajectory has the lines window,scan,x,y,theta: the poses by contours.";

/// Localising in a map of contours that was made from the rest of the same drive.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct ContourMap {
    #[command(flatten)]
    drive: DriveChoice,
    /// Length of a window, m.
    #[arg(long, default_value_t = 12.0)]
    length: f64,
    /// Size of the map's cells, m.
    #[arg(long, default_value_t = CELL)]
    cell: f64,
    /// Write the poses by contours to a file; an older one is replaced.
    #[arg(long, value_name = "CSV")]
    trajectory: Option<PathBuf>,
    /// Print a JSON array instead of a table.
    #[arg(long)]
    json: bool,
}

impl ContourMap {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        check_files(&self.trajectory)?;
        anyhow::ensure!(self.length > 0.0, "--length must be more than 0 m");
        anyhow::ensure!(self.cell >= 0.02 && self.cell <= 1.0, "--cell must be from 0.02 to 1 m");
        let drive = self.drive.read()?;
        let bar = progress::spinner().with_message("driving");
        bar.tick();
        let Localised { accuracies, poses, .. } = localise(&drive, self.length, self.cell)?;
        bar.finish_and_clear();
        anyhow::ensure!(!poses.is_empty(), "no window of the drive is covered by a map of the rest of it");
        if let Some(path) = &self.trajectory {
            trajectory::write(path, &poses)?;
        }
        if self.json {
            println!("{}", serde_json::to_string_pretty(&accuracies)?);
            return Ok(());
        }
        println!("{:<12} {:>7} {:>6} {:>6}   {:<22} deg", "", "windows", "lost", "MI", "m median, 95 %, max");
        for of in &accuracies {
            let misleading = of.mi_share.map_or("-".to_owned(), |share| format!("{:.1}%", 100.0 * share));
            println!(
                "{:<12} {:>7} {:>5.1}% {:>6} {:>7.3} {:>6.3} {:>6.3}   {:>7.2} {:>6.2} {:>6.2}",
                of.method,
                of.windows,
                100.0 * of.lost_share,
                misleading,
                of.position_m.median,
                of.position_m.p95,
                of.position_m.max,
                of.heading_deg.median,
                of.heading_deg.p95,
                of.heading_deg.max
            );
        }
        Ok(())
    }
}
