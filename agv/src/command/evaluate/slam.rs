//! `agv evaluate slam`.

use std::path::PathBuf;

use agv_host_sim::data;
use agv_host_sim::mapping::slam::SlamParameters;
use agv_lab::evaluate::slam::{OfficeDrive, page, run};
use anyhow::Context;

use crate::command::output::check_files;
use crate::command::progress;

const HELP: &str = "\
Examples:
  agv evaluate slam
  agv evaluate slam --report slam.html
  agv evaluate slam --log aces-corrected.log.gz --json";

/// A map of a real office from raw odometry and scans, against the corrected poses of others.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Slam {
    /// CARMEN log with raw odometry and corrected poses; that of fr079 if absent.
    #[arg(long)]
    log: Option<PathBuf>,
    /// Print a JSON array instead of a table.
    #[arg(long)]
    json: bool,
    /// Write a page with the figures and the maps.
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
}

impl Slam {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        check_files(&self.report)?;
        let folder = || {
            Ok::<_, anyhow::Error>(data::folder().context("set AGV_DATA to the folder of recordings")?.join("scans2d"))
        };
        let (drive, relations) = match &self.log {
            Some(log) => (OfficeDrive::of_carmen(log)?, None),
            None => {
                let folder = folder()?;
                let carmen_log = folder.join("freiburg-079-corrected.log.gz");
                (OfficeDrive::of_graph(&folder.join("fr079.log"), &carmen_log)?, Some(folder.join("fr079.relations")))
            }
        };
        let bar = progress::bar("mapping", 0);
        let mut results = Vec::new();
        for (name, parameters) in [("honest", SlamParameters::honest()), ("all", SlamParameters::all())] {
            results.push(run(&drive, relations.as_deref(), name, &parameters, || bar.inc(1))?);
        }
        bar.finish_and_clear();
        if let Some(report) = &self.report {
            page(&drive, &results)?.write(report).with_context(|| report.display().to_string())?;
        }
        let outcomes: Vec<_> = results.into_iter().map(|(outcome, _)| outcome).collect();
        if self.json {
            println!("{}", serde_json::to_string_pretty(&outcomes)?);
            return Ok(());
        }
        println!("closures  key scans  mean error  largest  heading  odometry  loops  refused  false  relations  s");
        for outcome in outcomes {
            println!(
                "{:<9} {:>9} {:>9.3} m {:>6.3} m {:>6.2}° {:>7.2} m {:>6} {:>8} {:>6} {:>8} {:>4.0}",
                outcome.closures,
                outcome.key_scans,
                outcome.mean_position_error_m,
                outcome.max_position_error_m,
                outcome.mean_heading_error_deg,
                outcome.odometry_error_m,
                outcome.loops,
                outcome.refused,
                outcome.false_loops,
                outcome.relations.map_or("-".to_owned(), |relations| format!(
                    "{:.3} m of {} (corrected {:.3})",
                    relations.mean_shift_m, relations.relations, relations.corrected_mean_shift_m
                )),
                outcome.seconds,
            );
        }
        Ok(())
    }
}
