//! `agv map`.

use std::path::PathBuf;

use agv_core::landmarks::{Landmark, LandmarkKind};
use agv_host_sim::log;
use agv_host_sim::mapping::{
    Clustering, map_features, map_features_at, map_file, map_reflectors_at, reflector_clustering,
};
use anyhow::{Context, bail, ensure};
use clap::ValueEnum;
use indicatif::ProgressBar;
use serde::Serialize;

use super::{output, progress};

const HELP: &str = "\
Examples:
  agv map drive.agvlog --output features.csv
  agv map drive.agvlog --output features.csv --poses truth
  agv map drive.agvlog --output reflectors.csv --kind reflectors

A map is a text file whose first line is 'id,kind,x_m,y_m,deviation_m', with one landmark a line.
Keys of --json: reflectors, corners, end_points, largest_deviation_mm.";

/// Build a map from a log with known poses.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Map {
    /// The log.
    log: PathBuf,
    /// Where the map goes; an older one is replaced.
    #[arg(short, long, value_name = "MAP")]
    output: PathBuf,
    /// What to map.
    #[arg(long, default_value = "features")]
    kind: Kind,
    /// Where the poses come from; for reflectors the truth if there is any, else the references.
    #[arg(long)]
    poses: Option<Poses>,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// Natural features.
    Features,
    /// Reflectors.
    Reflectors,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Poses {
    /// Localise the drive by the reflectors of its log.
    Localiser,
    /// The true poses in the log.
    Truth,
    /// The reference poses in the log, as far as they have a heading.
    References,
}

#[derive(Serialize)]
struct Summary {
    reflectors: usize,
    corners: usize,
    end_points: usize,
    largest_deviation_mm: Option<f64>,
}

impl Map {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let size = std::fs::metadata(&self.log).map_or(0, |metadata| metadata.len());
        let reading = progress::bar("reading", size);
        let (recording, damages) = log::read_contents(&self.log, |bytes| reading.set_position(bytes))
            .map(|read| (read.recording, read.damages))?;
        reading.finish_and_clear();
        let default = match self.kind {
            Kind::Features => Poses::Localiser,
            Kind::Reflectors if recording.truth.is_empty() => Poses::References,
            Kind::Reflectors => Poses::Truth,
        };
        let poses = match self.poses.unwrap_or(default) {
            Poses::Localiser => None,
            Poses::Truth => Some((recording.truth.clone(), "true poses")),
            Poses::References => Some((recording.referenced_poses(), "reference poses with a heading")),
        };
        if let Some((poses, name)) = &poses {
            ensure!(poses.len() > 1, "{}: the log has no {name}", self.log.display());
        }
        let looking = ProgressBar::new_spinner().with_message("looking for landmarks");
        looking.tick();
        let landmarks = match (self.kind, &poses) {
            (Kind::Reflectors, None) => {
                bail!("reflectors cannot be mapped from poses that rest on them; choose --poses truth or references")
            }
            (Kind::Reflectors, Some((poses, _))) => map_reflectors_at(&recording, poses, &reflector_clustering()),
            (Kind::Features, None) => map_features(&recording, &Clustering::default()),
            (Kind::Features, Some((poses, _))) => map_features_at(&recording, poses, &Clustering::default()),
        }
        .with_context(|| self.log.display().to_string())?;
        looking.finish_and_clear();
        ensure!(!landmarks.is_empty(), "{}: no landmark was seen often enough from known poses", self.log.display());
        map_file::write(&self.output, &landmarks)?;
        for damage in &damages {
            eprintln!("{}: {damage}", self.log.display());
        }
        let summary = Summary::of(&landmarks);
        if self.json {
            println!("{}", serde_json::to_string_pretty(&summary)?);
            return Ok(());
        }
        output::print_rows(&[
            ["reflectors".to_owned(), summary.reflectors.to_string()],
            ["corners".to_owned(), summary.corners.to_string()],
            ["end points".to_owned(), summary.end_points.to_string()],
            ["largest deviation".to_owned(), format!("{:.1} mm", summary.largest_deviation_mm.unwrap_or_default())],
        ]);
        Ok(())
    }
}

impl Summary {
    fn of(landmarks: &[Landmark]) -> Self {
        let count = |kind| landmarks.iter().filter(|landmark| landmark.kind == kind).count();
        Self {
            reflectors: count(LandmarkKind::Reflector),
            corners: count(LandmarkKind::Corner),
            end_points: count(LandmarkKind::EndPoint),
            largest_deviation_mm: landmarks
                .iter()
                .map(|landmark| 1e3 * f64::from(landmark.deviation))
                .max_by(f64::total_cmp),
        }
    }
}
