//! The detector on the office logs of the thesis: number, repeatability and time of its keypoints, and how many of the
//! reference program's keypoints it finds.

use std::collections::HashSet;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::Instant;

use agv_core::geometry::Point;
use agv_core::sensing::falko::{Detector, Parameters};
use agv_core::sensing::{Keypoint, PointScan};
use anyhow::Context;
use serde::{Deserialize, Serialize};

use super::repeatability;
use agv_host_sim::data;
pub use agv_host_sim::import::{BEAMS, KEYPOINTS, RANGES};
use agv_host_sim::import::{PosedScan, graph_log};

/// Columns of the reference program's file before those of the histogram.
const COLUMNS_BEFORE_HISTOGRAM: usize = 7;

/// A log of scans with known poses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Set {
    /// Freiburg, building 079: 1464 scans of 360 beams.
    Fr079,
    /// Intel laboratory, Seattle: 2672 scans of 180 beams.
    Intel,
}

impl Set {
    fn files(self) -> (&'static str, &'static str) {
        match self {
            Self::Fr079 => ("scans2d/fr079.log", "falko_reference/fr079_thesis_parameters_defects_mended.csv"),
            Self::Intel => ("scans2d/intel-lab.log", "falko_reference/intel_thesis_parameters_defects_mended.csv"),
        }
    }

    /// Reads the scans.
    pub fn scans(self) -> anyhow::Result<Vec<PosedScan>> {
        Ok(graph_log::read(&in_data(self.files().0)?)?.log.scans)
    }

    /// Reads the reference program's keypoints.
    pub fn reference(self) -> anyhow::Result<Vec<ReferenceKeypoint>> {
        let path = in_data(self.files().1)?;
        let file = File::open(&path).with_context(|| format!("cannot read {}", path.display()))?;
        let mut reader = csv::Reader::from_reader(file);
        let header = reader.headers()?.clone();
        let rows: Result<Vec<_>, csv::Error> = reader
            .records()
            .map(|record| {
                let record = record?;
                let bins = record.iter().skip(COLUMNS_BEFORE_HISTOGRAM).map(str::parse);
                let histogram = bins.collect::<Result<Vec<f32>, _>>().ok().filter(|bins| !bins.is_empty());
                Ok(ReferenceKeypoint { histogram, ..record.deserialize(Some(&header))? })
            })
            .collect();
        rows.with_context(|| format!("{} is not what the reference program writes", path.display()))
    }
}

fn in_data(name: impl AsRef<Path>) -> anyhow::Result<PathBuf> {
    let folder = data::folder().context("no folder of recordings: set AGV_DATA")?;
    Ok(folder.join(name))
}

/// A keypoint that the reference program found.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct ReferenceKeypoint {
    /// Index of the scan.
    pub scan: usize,
    /// Index of the beam.
    pub beam_index: u16,
    /// Position in the frame of the laser, m.
    pub x_m: f32,
    /// Position in the frame of the laser, m.
    pub y_m: f32,
    /// Direction of the corner, rad.
    pub orientation_rad: f32,
    /// Radius of the neighbourhood, m.
    pub radius_m: f32,
    /// Cells of the binary shape context, ring by ring, as digits; empty where the file has none.
    #[serde(default)]
    pub bsc_bits: String,
    /// The 16 bins of the cumulative Gaussian histogram, where the file has them.
    #[serde(skip)]
    pub histogram: Option<Vec<f32>>,
}

/// What one profile of the detector does on a log.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Name of the profile.
    pub profile: &'static str,
    /// Mean number of keypoints.
    pub keypoints_per_scan: f64,
    /// Share of the reference program's keypoints that are found at the same beam of the same scan.
    pub reference_match: f64,
    /// Mean repeatability over pairs of scans that both have keypoints; none if there is no such pair.
    pub repeatability: Option<f64>,
    /// Mean repeatability over all pairs; a pair in which a scan has no keypoint counts as zero.
    pub repeatability_counting_empty: Option<f64>,
    /// Time of detection, us, best of a few passes over the log on one core.
    pub us_per_scan: f64,
    /// Number of scans.
    pub scans: usize,
}

/// The profiles by name.
#[must_use]
pub fn profiles() -> [(&'static str, Parameters); 3] {
    [("thesis", Parameters::thesis()), ("reference", Parameters::reference()), ("mended", Parameters::mended())]
}

/// Keypoints of scans with known poses, scan by scan.
pub fn detect<'a>(
    scans: impl IntoIterator<Item = &'a PosedScan>,
    parameters: Parameters,
) -> impl Iterator<Item = Vec<Keypoint>> {
    let mut detector = Box::new(Detector::<BEAMS>::new(parameters));
    let mut points = Box::new(PointScan::<BEAMS>::new());
    let mut keypoints = heapless::Vec::<Keypoint, KEYPOINTS>::new();
    scans.into_iter().map(move |scan| {
        points.set(&scan.scan.view(), RANGES.0, RANGES.1);
        detector.detect(&points, &mut keypoints);
        keypoints.to_vec()
    })
}

/// Measures every profile on a log.
pub fn run(set: Set) -> anyhow::Result<Vec<Outcome>> {
    let scans = set.scans()?;
    let reference = set.reference()?;
    let pairs = repeatability::overlapping_pairs(&scans);
    let outcomes = profiles().into_iter().map(|(profile, parameters)| {
        let keypoints: Vec<_> = detect(&scans, parameters).collect();
        let score = repeatability::score(&scans, &positions(&keypoints), &pairs);
        Outcome {
            profile,
            keypoints_per_scan: keypoints.iter().map(Vec::len).sum::<usize>() as f64 / scans.len() as f64,
            reference_match: reference_match(&keypoints, &reference),
            repeatability: Some(score.excluding_empty).filter(|share| share.is_finite()),
            repeatability_counting_empty: Some(score.counting_empty).filter(|share| share.is_finite()),
            us_per_scan: time(&scans, parameters),
            scans: scans.len(),
        }
    });
    Ok(outcomes.collect())
}

/// Positions of keypoints, scan by scan, m.
#[must_use]
pub fn positions(keypoints: &[Vec<Keypoint>]) -> Vec<Vec<Point>> {
    keypoints.iter().map(|scan| scan.iter().map(|keypoint| keypoint.position.cast()).collect()).collect()
}

/// Share of the reference program's keypoints that are among `keypoints`, at the same beam of the same scan.
#[must_use]
pub fn reference_match(keypoints: &[Vec<Keypoint>], reference: &[ReferenceKeypoint]) -> f64 {
    let found: HashSet<_> = keypoints
        .iter()
        .enumerate()
        .flat_map(|(scan, keypoints)| keypoints.iter().map(move |keypoint| (scan, keypoint.beam)))
        .collect();
    let same = reference.iter().filter(|keypoint| found.contains(&(keypoint.scan, keypoint.beam_index))).count();
    same as f64 / reference.len() as f64
}

/// Passes over a log of which the fastest counts.
const PASSES: usize = 5;

fn time(scans: &[PosedScan], parameters: Parameters) -> f64 {
    let mut detector = Box::new(Detector::<BEAMS>::new(parameters));
    let mut keypoints = heapless::Vec::<Keypoint, KEYPOINTS>::new();
    let points: Vec<_> = scans
        .iter()
        .map(|scan| {
            let mut points = Box::new(PointScan::<BEAMS>::new());
            points.set(&scan.scan.view(), RANGES.0, RANGES.1);
            points
        })
        .collect();
    let pass = |_| {
        let start = Instant::now();
        for points in &points {
            detector.detect(points, &mut keypoints);
        }
        start.elapsed().as_secs_f64() * 1e6 / scans.len() as f64
    };
    (0..PASSES).map(pass).fold(f64::INFINITY, f64::min)
}
