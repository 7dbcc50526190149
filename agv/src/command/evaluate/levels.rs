//! `agv evaluate levels`.

use std::path::PathBuf;

use agv_host_sim::{data, output_file};
use agv_lab::evaluate::levels::{Recorded, building, car_park};
use agv_lab::trust::page::diagram;
use anyhow::Context;
use clap::ValueEnum;

use super::office_drive::{self, DriveSet};
use crate::command::output::check_files;
use crate::command::progress;

const HELP: &str = "\
Examples:
  agv evaluate levels
  agv evaluate levels --log drive.log --json
  agv evaluate levels --diagrams pictures

Keys of --json: an array of drive, mode, claims, silent, mi_share, hazardous, available_share, error_over_pl_max, position_m and pl_m
{median, p95, max}, stanford {cell_mm, cells [level, error, claims]}.
The pictures of --diagrams are stanford_DRIVE_MODE.svg.";

/// Errors against protection levels on real drives: the car park against its satellite receiver, and buildings in maps of the rest of each
/// drive against corrected poses. The chapter \"Trust\" of the book has the definitions.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Levels {
    /// CARMEN log with raw odometry and corrected poses, instead of the recordings in the folder of AGV_DATA.
    #[arg(long)]
    log: Option<PathBuf>,
    /// Length of a window of a building, m.
    #[arg(long, default_value_t = 12.0)]
    length: f64,
    /// Write the Stanford diagrams into a folder.
    #[arg(long, value_name = "FOLDER")]
    diagrams: Option<PathBuf>,
    /// Print a JSON array instead of a table.
    #[arg(long)]
    json: bool,
}

impl Levels {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        anyhow::ensure!(self.length > 0.0, "--length must be more than 0 m");
        check_files(&self.diagrams.as_ref().map(|folder| folder.join("stanford.svg")))?;
        let rows = self.rows()?;
        anyhow::ensure!(
            rows.iter().all(|row| row.claims + row.silent > 0),
            "no window of the drive is covered by a map of the rest of it"
        );
        if let Some(folder) = &self.diagrams {
            for row in &rows {
                let name = format!("stanford_{}_{}.svg", row.drive, row.mode).replace(' ', "_");
                let path = folder.join(name);
                output_file::write(&path, diagram(&row.stanford)?.one_line())
                    .with_context(|| path.display().to_string())?;
            }
        }
        if self.json {
            println!("{}", serde_json::to_string_pretty(&rows)?);
            return Ok(());
        }
        println!(
            "{:<13} {:<18} {:>6} {:>6} {:>6} {:>4} {:>7} {:>8}   {:<21} PL, m",
            "", "", "claims", "silent", "MI", "HMI", "within", "error/PL", "m median, 95 %, max"
        );
        for row in &rows {
            println!(
                "{:<13} {:<18} {:>6} {:>6} {:>5.2}% {:>4} {:>6.1}% {:>8.2}   {:>6.3} {:>6.3} {:>6.3}   {:>6.3} {:>6.3} {:>6.3}",
                row.drive,
                row.mode,
                row.claims,
                row.silent,
                100.0 * row.mi_share,
                row.hazardous,
                100.0 * row.available_share,
                row.error_over_pl_max,
                row.position_m.median,
                row.position_m.p95,
                row.position_m.max,
                row.pl_m.median,
                row.pl_m.p95,
                row.pl_m.max
            );
        }
        Ok(())
    }

    fn rows(&self) -> anyhow::Result<Vec<Recorded>> {
        let bar = progress::spinner().with_message("driving");
        bar.tick();
        if let Some(log) = &self.log {
            let drive = office_drive::read(log)?;
            let name = log.file_stem().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
            return Ok(vec![building(&name, &drive, self.length)?]);
        }
        let folder = data::folder().context("the recordings are not there: set AGV_DATA to their folder")?;
        let mut rows = car_park(&folder.join("carpark"))?;
        for set in DriveSet::value_variants() {
            let (name, log) = set.log()?;
            rows.push(building(&name, &office_drive::read(&log)?, self.length)?);
        }
        bar.finish_and_clear();
        Ok(rows)
    }
}
