//! `agv report`.

use std::path::{Path, PathBuf};

use agv_core::record::Damage;
use agv_host_sim::drive::{Figures, ReplayedDrive, Track, report_page};
use agv_host_sim::log::{self, Contents};
use agv_host_sim::replay::{Comparisons, replay};
use agv_host_sim::report::write_pdf;
use anyhow::{Context, ensure};
use serde::Serialize;

use super::drive_summary::DriveSummary;
use super::{output, progress};

const HELP: &str = "\
Examples:
  agv report drive.agvlog
  agv report before.agvlog after.agvlog --output comparison.html --pdf comparison.pdf";

/// Write one page about one drive, or about several side by side
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Report {
    /// The logs.
    #[arg(required = true)]
    logs: Vec<PathBuf>,
    /// Page to write, which needs no other file; an older one is replaced.
    #[arg(short, long, value_name = "FILE", default_value = "report.html")]
    output: PathBuf,
    /// Write the page as PDF, too; Chromium prints it.
    #[arg(long, value_name = "FILE")]
    pdf: Option<PathBuf>,
    /// Print a JSON array: for each log its name and what `agv replay --json` has.
    #[arg(long)]
    json: bool,
}

/// Logs that fit side by side.
const MOST: usize = 7;

#[derive(Serialize)]
struct Entry<'a> {
    name: &'a str,
    #[serde(flatten)]
    summary: DriveSummary<'a>,
}

impl Report {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        ensure!(self.logs.len() <= MOST, "at most {MOST} logs fit side by side");
        output::check_files(std::iter::once(&self.output).chain(&self.pdf))?;
        let replayed: Vec<_> = self.logs.iter().map(|path| replayed(path)).collect::<Result<_, _>>()?;
        let (mut drives, about): (Vec<_>, Vec<_>) = replayed.into_iter().unzip();
        name_apart(&mut drives, &self.logs);
        let page = report_page(&drives)?;
        page.write(&self.output).with_context(|| self.output.display().to_string())?;
        if let Some(pdf) = &self.pdf {
            write_pdf(&self.output, pdf)?;
        }
        if self.json {
            let entries: Vec<_> = drives.iter().zip(&about).map(|(drive, about)| about.entry(drive)).collect();
            println!("{}", serde_json::to_string_pretty(&entries)?);
            return Ok(());
        }
        let written = std::iter::once(&self.output).chain(&self.pdf);
        let rows: Vec<_> = written.map(|path| ["report".to_owned(), path.display().to_string()]).collect();
        output::print_rows(&rows);
        Ok(())
    }
}

/// What there is to say about a log beside its figures.
struct About {
    software: String,
    comparisons: Comparisons,
    damages: Vec<Damage>,
}

impl About {
    fn entry<'a>(&'a self, drive: &'a ReplayedDrive) -> Entry<'a> {
        let summary = DriveSummary::new(&self.software, &drive.figures, self.comparisons, &self.damages);
        Entry { name: &drive.name, summary }
    }
}

/// Replays a log.
fn replayed(path: &Path) -> anyhow::Result<(ReplayedDrive, About)> {
    let Contents { software, recording, outputs, publishing, damages } = log::read_contents(path, |_| ())?;
    let bar = progress::bar("replaying", recording.events.len() as u64);
    let replay =
        replay(&recording, |events| bar.set_position(events as u64)).with_context(|| path.display().to_string())?;
    bar.finish_and_clear();
    let comparisons = Comparisons::of(&outputs, &publishing, &recording, &replay);
    let mut remarks = vec![["written by".to_owned(), software.clone()]];
    remarks.extend(comparisons.remarks());
    remarks.push(["places with damage".to_owned(), damages.len().to_string()]);
    let track = Track::new(&recording, &replay);
    let figures = Figures::new(&recording, &replay, &track);
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let drive = ReplayedDrive { name, remarks, recording, replay, track, figures };
    Ok((drive, About { software, comparisons, damages }))
}

/// Logs of one name in different folders are told apart by their paths.
fn name_apart(drives: &mut [ReplayedDrive], logs: &[PathBuf]) {
    let names: Vec<String> = drives.iter().map(|drive| drive.name.clone()).collect();
    for (drive, path) in drives.iter_mut().zip(logs) {
        if names.iter().filter(|name| **name == drive.name).count() > 1 {
            drive.name = path.display().to_string();
        }
    }
}
