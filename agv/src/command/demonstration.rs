//! `agv` without a command.

use std::path::PathBuf;

use agv_host_sim::drive::Figures;
use agv_host_sim::log;
use agv_lab::evaluate::demonstration::{self, LocalisedDrive};
use anyhow::Context;
use serde::Serialize;

use super::progress;

/// Names of the options below.
pub const OPTIONS: [&str; 2] = ["report", "json"];

/// One drive, localised in six ways.
#[derive(clap::Args)]
pub struct Demonstration {
    /// Folder for the report and the log of the drive.
    #[arg(long, value_name = "DIR", default_value = "report")]
    report: PathBuf,
    /// Print a JSON array instead of a table: for each way to localise its name and the figures that `agv replay --json` has.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Entry<'a> {
    name: &'a str,
    #[serde(flatten)]
    figures: &'a Figures,
}

impl Demonstration {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let spinner = progress::spinner();
        let drives = demonstration::run(|doing| {
            spinner.set_message(doing);
            spinner.tick();
        })?;
        spinner.set_message("drawing");
        let report = self.report.join("index.html");
        demonstration::page(&drives)?.write(&report).with_context(|| report.display().to_string())?;
        let log = self.report.join("drive.agvlog");
        if let Some(LocalisedDrive { recording, replay, .. }) = drives.last() {
            log::write_with_outputs(&log, recording, |event| replay.output(event))?;
        }
        spinner.finish_and_clear();
        if self.json {
            let entries: Vec<_> =
                drives.iter().map(|drive| Entry { name: drive.name, figures: &drive.figures }).collect();
            println!("{}", serde_json::to_string_pretty(&entries)?);
            return Ok(());
        }
        let mut lines = vec![
            format!(
                "A simulated drive, 12 m into a block storage, localised in {} ways:",
                demonstration::NUMBER_OF_WAYS
            ),
            String::new(),
        ];
        lines.extend(table(&drives));
        if let Some(drive) = drives.last() {
            lines.push(String::new());
            lines.push(format!("replayed {:.0} times faster than real time", drive.figures.realtime_factor));
        }
        lines.push(format!("report   {}", report.display()));
        lines.push(format!("log      {}", log.display()));
        println!("{}", lines.join("\n"));
        Ok(())
    }
}

/// The figures in columns.
fn table(drives: &[LocalisedDrive]) -> Vec<String> {
    let width = drives.iter().map(|drive| drive.name.len()).max().unwrap_or_default();
    let mut lines = vec![
        format!(
            "{:<width$} {:>29}   {:>29}   {:>5}   {:>9}",
            "", "position error, mm", "heading error, deg", "NEES", "2 cm and"
        ),
        format!(
            "{:<width$} {:>8} {:>6} {:>6} {:>6}   {:>8} {:>6} {:>6} {:>6}   {:>5}   {:>9}",
            "localised by", "median", "95 %", "max", "end", "median", "95 %", "max", "end", "(3)", "0.1 deg"
        ),
    ];
    for (drive, row) in drives.iter().zip(demonstration::table(drives).rows) {
        let [_, values @ .., ok] = &row[..] else { continue };
        let name = drive.name;
        let [p50, p95, pmax, pend, h50, h95, hmax, hend, nees] = values else { continue };
        lines.push(format!(
            "{name:<width$} {p50:>8} {p95:>6} {pmax:>6} {pend:>6}   {h50:>8} {h95:>6} {hmax:>6} {hend:>6}   {nees:>5}   {ok:>7} %"
        ));
    }
    lines
}
