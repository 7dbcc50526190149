//! `agv map`.

use std::path::PathBuf;

use agv_core::maps::{Landmark, LandmarkKind};
use agv_host_sim::log;
use agv_host_sim::mapping::{
    Clustering, contour_file, contour_mapper, map_features, map_features_at, map_file, map_reflectors_at,
    reflector_clustering, slam::SlamParameters, slam_poses,
};
use agv_host_sim::recording::{Recording, Truth};
use anyhow::{Context, bail, ensure};
use clap::ValueEnum;
use serde::Serialize;

use super::vehicle_argument::VehicleArgument;
use super::{output, progress};

const HELP: &str = "\
Examples:
  agv map drive.agvlog --output features.csv
  agv map drive.agvlog --output features.csv --poses truth
  agv map drive.agvlog --output reflectors.csv --kind reflectors
  agv map drive.agvlog --output features.csv --slam
  agv map drive.agvlog --output contours.csv --kind contours --poses localiser

A map of contours has the first line 'x_m,y_m,facing_deg', with one point of a surface a line.
A map of landmarks has the first line 'id,kind,x_m,y_m,deviation_m', with one landmark a line.
Keys of --json: reflectors, corners, end_points, largest_deviation_mm; of contours points, bytes; with --slam also
key_scans, loops.";

/// Build a map from a log with known poses.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Map {
    /// The log.
    log: PathBuf,
    #[command(flatten)]
    vehicle: VehicleArgument,
    /// Where the map goes; an older one is replaced.
    #[arg(short, long, value_name = "MAP")]
    output: PathBuf,
    /// What to map.
    #[arg(long, default_value = "features")]
    kind: Kind,
    /// Where the poses come from; for reflectors and contours the truth if there is any, else the references, for features and else for
    /// contours the localiser.
    #[arg(long)]
    poses: Option<Poses>,
    /// Find the poses too, from odometry, scans and the loops that are recognised; nothing is known of the hall.
    #[arg(long, conflicts_with = "poses")]
    slam: bool,
    /// Size of the cells of a map of contours, m; 0.2 if absent.
    #[arg(long)]
    cell: Option<f64>,
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
    /// Contours: points of all surfaces.
    Contours,
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
    #[serde(skip_serializing_if = "Option::is_none")]
    key_scans: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    loops: Option<usize>,
}

impl Map {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        ensure!(self.cell.is_none() || self.kind == Kind::Contours, "--cell: only a map of contours has cells");
        ensure!(self.cell.is_none_or(|cell| (0.02..=1.0).contains(&cell)), "--cell must be from 0.02 to 1 m");
        let size = std::fs::metadata(&self.log).map_or(0, |metadata| metadata.len());
        let reading = progress::bar("reading", size);
        let (mut recording, damages) = log::read_contents(&self.log, |bytes| reading.set_position(bytes))
            .map(|read| (read.recording, read.damages))?;
        reading.finish_and_clear();
        self.vehicle.apply(&mut recording.parameters, &self.log)?;
        let (poses, slam) = self.known_poses(&recording)?;
        if let Some((poses, name)) = &poses {
            ensure!(poses.len() > 1, "{}: the log has no {name}", self.log.display());
        }
        if self.kind == Kind::Contours {
            for damage in &damages {
                output::note(&format!("{}: {damage}", self.log.display()));
            }
            return self.map_contours(&recording, poses.as_ref().map(|(poses, _)| &**poses), slam);
        }
        let landmarks = self.landmarks(&recording, poses.as_ref().map(|(poses, _)| &**poses))?;
        ensure!(!landmarks.is_empty(), "{}: no landmark was seen often enough from known poses", self.log.display());
        map_file::write(&self.output, &landmarks)?;
        for damage in &damages {
            output::note(&format!("{}: {damage}", self.log.display()));
        }
        let summary =
            Summary { key_scans: slam.map(|slam| slam.0), loops: slam.map(|slam| slam.1), ..Summary::of(&landmarks) };
        if self.json {
            println!("{}", serde_json::to_string_pretty(&summary)?);
            return Ok(());
        }
        let mut rows = vec![
            ["reflectors".to_owned(), summary.reflectors.to_string()],
            ["corners".to_owned(), summary.corners.to_string()],
            ["end points".to_owned(), summary.end_points.to_string()],
            ["largest deviation".to_owned(), format!("{:.1} mm", summary.largest_deviation_mm.unwrap_or_default())],
        ];
        if let Some((keys, loops)) = slam {
            rows.push(["key scans".to_owned(), keys.to_string()]);
            rows.push(["loops".to_owned(), loops.to_string()]);
        }
        output::print_rows(&rows);
        Ok(())
    }
}

/// Poses, and what they are called.
type NamedPoses = (Vec<Truth>, &'static str);

/// Key scans, and loops that were closed.
type SlamCounts = (usize, usize);

impl Map {
    /// From which poses the map is made, with what they are called; none for those of the localiser. Then the key scans and
    /// loops of SLAM.
    fn known_poses(&self, recording: &Recording) -> anyhow::Result<(Option<NamedPoses>, Option<SlamCounts>)> {
        let mut slam = None;
        let default = match self.kind {
            Kind::Features => Poses::Localiser,
            Kind::Reflectors if recording.truth.is_empty() => Poses::References,
            Kind::Reflectors => Poses::Truth,
            Kind::Contours if !recording.truth.is_empty() => Poses::Truth,
            Kind::Contours if recording.referenced_poses().len() > 1 => Poses::References,
            Kind::Contours => Poses::Localiser,
        };
        let poses = match self.poses.unwrap_or(default) {
            _ if self.slam => {
                let bar = progress::spinner().with_message("finding the poses");
                let found = slam_poses(recording, &SlamParameters::all(), || bar.tick())
                    .with_context(|| self.log.display().to_string())?;
                bar.finish_and_clear();
                ensure!(!found.1.keys.is_empty(), "{}: the log has no scans", self.log.display());
                slam = Some((found.1.keys.len(), found.1.closures.len()));
                Some((found.0, "poses"))
            }
            Poses::Localiser => None,
            Poses::Truth => Some((recording.truth.clone(), "true poses")),
            Poses::References => Some((recording.referenced_poses(), "reference poses with a heading")),
        };
        Ok((poses, slam))
    }

    fn landmarks(&self, recording: &Recording, poses: Option<&[Truth]>) -> anyhow::Result<Vec<Landmark>> {
        let looking = progress::spinner().with_message("looking for landmarks");
        looking.tick();
        let landmarks = match (self.kind, poses) {
            (Kind::Reflectors, None) => {
                bail!("reflectors cannot be mapped from poses that rest on them; choose --poses truth or references")
            }
            (Kind::Reflectors, Some(poses)) => map_reflectors_at(recording, poses, &reflector_clustering()),
            (Kind::Contours, _) => bail!("contours are no landmarks"),
            (Kind::Features, None) => map_features(recording, &Clustering::default()),
            (Kind::Features, Some(poses)) => map_features_at(recording, poses, &Clustering::default()),
        }
        .with_context(|| self.log.display().to_string())?;
        looking.finish_and_clear();
        Ok(landmarks)
    }

    fn map_contours(
        &self,
        recording: &Recording,
        poses: Option<&[Truth]>,
        slam: Option<SlamCounts>,
    ) -> anyhow::Result<()> {
        let mapping = progress::spinner().with_message("mapping contours");
        mapping.tick();
        let cell = self.cell.unwrap_or(contour_mapper::CELL);
        let map = match poses {
            Some(poses) => contour_mapper::map_contours_at(recording, poses, cell),
            None => contour_mapper::map_contours(recording, cell).with_context(|| self.log.display().to_string())?,
        };
        mapping.finish_and_clear();
        ensure!(!map.is_empty(), "{}: no surface was seen from known poses", self.log.display());
        contour_file::write(&self.output, &map)?;
        let summary = ContourSummary {
            points: map.len(),
            bytes: map.bytes().len(),
            key_scans: slam.map(|slam| slam.0),
            loops: slam.map(|slam| slam.1),
        };
        if self.json {
            println!("{}", serde_json::to_string_pretty(&summary)?);
            return Ok(());
        }
        let mut rows = vec![
            ["points".to_owned(), summary.points.to_string()],
            ["size in the vehicle".to_owned(), format!("{} bytes", summary.bytes)],
        ];
        if let Some((keys, loops)) = slam {
            rows.push(["key scans".to_owned(), keys.to_string()]);
            rows.push(["loops".to_owned(), loops.to_string()]);
        }
        output::print_rows(&rows);
        Ok(())
    }
}

#[derive(Serialize)]
struct ContourSummary {
    points: usize,
    bytes: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    key_scans: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    loops: Option<usize>,
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
            key_scans: None,
            loops: None,
        }
    }
}
