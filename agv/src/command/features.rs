//! `agv features`.

use std::path::PathBuf;

use agv_core::sensing::falko::Parameters;
use agv_host_sim::export;
use agv_lab::evaluate::falko;
use anyhow::Context;

use super::posed_scans;

/// Find keypoints in the scans of a log.
#[derive(clap::Args)]
pub struct Features {
    #[command(subcommand)]
    action: Action,
}

#[derive(clap::Subcommand)]
enum Action {
    Export(Export),
}

const HELP: &str = "\
Examples:
  agv features export fr079.log keypoints --profile thesis
  agv features export drive.agvlog keypoints --json";

/// Write scans, poses and keypoints as text files for an independent scoring program.
#[derive(clap::Args)]
#[command(after_help = HELP)]
struct Export {
    /// Log with references or true poses; or a pose-graph log (VERTEX2, ROBOTLASER1) or CARMEN log (FLASER), plain or .gz.
    log: PathBuf,
    /// Folder for scans.txt, poses.txt and keypoints.csv.
    folder: PathBuf,
    /// Parameters of the detector.
    #[arg(long, default_value = "mended", value_parser = profile)]
    profile: Parameters,
    /// Print how many scans and keypoints there are as JSON.
    #[arg(long)]
    json: bool,
}

impl Features {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        match self.action {
            Action::Export(export) => export.run(),
        }
    }
}

impl Export {
    fn run(self) -> anyhow::Result<()> {
        let scans = posed_scans::read(&self.log)?;
        let mut count = 0;
        let keypoints =
            scans.iter().zip(falko::detect(&scans, self.profile)).inspect(|(_, found)| count += found.len());
        export::keypoints::write(&self.folder, keypoints)
            .with_context(|| format!("cannot write into {}", self.folder.display()))?;
        if self.json {
            println!("{}", serde_json::json!({ "scans": scans.len(), "keypoints": count }));
        } else {
            println!("{count} keypoints in {} scans", scans.len());
        }
        Ok(())
    }
}

fn profile(name: &str) -> Result<Parameters, String> {
    let known = falko::profiles();
    let names: Vec<_> = known.iter().map(|(name, _)| *name).collect();
    let found = known.iter().find(|(known, _)| *known == name);
    found.map(|(_, parameters)| *parameters).ok_or_else(|| format!("known profiles: {}", names.join(", ")))
}
