//! `agv features`.

use std::io::Read;
use std::path::{Path, PathBuf};

use agv_core::features::falko::Parameters;
use agv_core::record::MAGIC;
use agv_host_sim::evaluate::falko;
use agv_host_sim::import::{PosedScan, carmen, graph_log};
use agv_host_sim::{export, log};
use anyhow::Context;

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
        let scans = read(&self.log)?;
        anyhow::ensure!(!scans.is_empty(), "{} has no scans with poses", self.log.display());
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

/// Scans of a log whose format its first bytes tell.
fn read(path: &Path) -> anyhow::Result<Vec<PosedScan>> {
    let mut start = [0; 7];
    let opened = std::fs::File::open(path).with_context(|| format!("cannot read {}", path.display()))?;
    // A file shorter than the word is no graph.
    let is_graph = { opened }.read_exact(&mut start).is_ok() && &start == b"VERTEX2";
    if start.starts_with(&MAGIC) {
        return Ok(PosedScan::of_recording(&log::read(path)?.0));
    }
    Ok(if is_graph { graph_log::read(path)?.log.scans } else { carmen::read(path)?.front.scans })
}

fn profile(name: &str) -> Result<Parameters, String> {
    let known = falko::profiles();
    let names: Vec<_> = known.iter().map(|(name, _)| *name).collect();
    let found = known.iter().find(|(known, _)| *known == name);
    found.map(|(_, parameters)| *parameters).ok_or_else(|| format!("known profiles: {}", names.join(", ")))
}
