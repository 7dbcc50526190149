//! Keypoints and descriptors of scans.

use std::time::Instant;

use agv_core::features::falko::{Detector, Parameters, Sectors};
use agv_core::features::{
    BinaryShapeContext, CumulativeGaussianHistogram, Kernel, Keypoint, OrthogonalCorners, PointScan,
};
use agv_core::geometry::{Point, Pose};
use serde::Serialize;

use crate::evaluate::falko::{BEAMS, KEYPOINTS, RANGES};
use crate::import::PosedScan;
use crate::recording::RecordedScan;

/// Radius of a descriptor, m (K 3.3.2).
pub const DESCRIPTOR_RADIUS: f32 = 0.5;
/// Standard deviation of a histogram's kernel, bins (K 3.3.2).
pub const DESCRIPTOR_SIGMA: f32 = 0.6;

/// Which keypoints are looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DetectorKind {
    /// FALKO with the printed parameters (K 3.3.1: beta 4, 16 sectors).
    Falko,
    /// Orthogonal corners.
    Oc,
}

/// What is seen in one scan.
#[derive(Clone, Debug, Default)]
pub struct Frame {
    /// Keypoints in S.
    pub keypoints: Vec<Keypoint>,
    /// Their binary shape contexts.
    pub shapes: Vec<BinaryShapeContext>,
    /// Their histograms.
    pub histograms: Vec<CumulativeGaussianHistogram>,
}

impl Frame {
    /// Positions of the keypoints in the frame in which `laser` is the pose of S, m.
    #[must_use]
    pub fn positions(&self, laser: &Pose) -> Vec<Point> {
        self.keypoints.iter().map(|keypoint| laser.transform(&keypoint.position.cast())).collect()
    }
}

/// Finds and describes the keypoints of scans.
pub struct Observer {
    kind: DetectorKind,
    falko: Box<Detector<BEAMS>>,
    corners: Box<OrthogonalCorners>,
    points: Box<PointScan<BEAMS>>,
    found: heapless::Vec<Keypoint, KEYPOINTS>,
    sectors: Sectors,
    kernel: Kernel,
}

impl Observer {
    /// An observer with one detector.
    #[must_use]
    pub fn new(kind: DetectorKind) -> Self {
        Self {
            kind,
            falko: Box::new(Detector::new(Parameters::thesis())),
            corners: Box::default(),
            points: Box::new(PointScan::new()),
            found: heapless::Vec::new(),
            sectors: Sectors::new(BinaryShapeContext::SECTORS, true),
            kernel: Kernel::gaussian(DESCRIPTOR_SIGMA),
        }
    }

    /// Observes scan by scan.
    pub fn observe_all<'a>(&mut self, scans: impl IntoIterator<Item = &'a RecordedScan>) -> Vec<Frame> {
        scans.into_iter().map(|scan| self.observe(scan)).collect()
    }

    fn observe(&mut self, scan: &RecordedScan) -> Frame {
        self.points.set(&scan.view(), RANGES.0, RANGES.1);
        self.detect();
        Frame { keypoints: self.found.to_vec(), shapes: self.shapes(), histograms: self.histograms() }
    }

    fn detect(&mut self) {
        match self.kind {
            DetectorKind::Falko => self.falko.detect(&self.points, &mut self.found),
            DetectorKind::Oc => self.corners.detect(&self.points, &mut self.found),
        };
    }

    fn shapes(&self) -> Vec<BinaryShapeContext> {
        let describe =
            |keypoint| BinaryShapeContext::describe(&self.points, keypoint, DESCRIPTOR_RADIUS, &self.sectors);
        self.found.iter().map(describe).collect()
    }

    fn histograms(&self) -> Vec<CumulativeGaussianHistogram> {
        let describe = |keypoint| {
            CumulativeGaussianHistogram::describe(
                &self.points,
                keypoint,
                DESCRIPTOR_RADIUS,
                &self.sectors,
                &self.kernel,
            )
        };
        self.found.iter().map(describe).collect()
    }
}

/// Repetitions of a scan of which the time is measured.
const REPETITIONS: u32 = 8;

/// Times of detection and of each descriptor of a scan, us, on one core.
#[must_use]
pub fn times(kind: DetectorKind, scans: &[PosedScan]) -> [f64; 3] {
    let mut observer = Observer::new(kind);
    let mut times = [0.0; 3];
    let scans: Vec<_> = scans.iter().step_by((scans.len() / 256).max(1)).collect();
    for scan in &scans {
        observer.points.set(&scan.scan.view(), RANGES.0, RANGES.1);
        let mut measure = |time: &mut f64, work: &mut dyn FnMut(&mut Observer)| {
            work(&mut observer);
            let start = Instant::now();
            for _ in 0..REPETITIONS {
                work(&mut observer);
            }
            *time += start.elapsed().as_secs_f64() * 1e6 / f64::from(REPETITIONS);
        };
        let [detection, shapes, histograms] = &mut times;
        measure(detection, &mut Observer::detect);
        measure(shapes, &mut |observer| {
            std::hint::black_box(observer.shapes());
        });
        measure(histograms, &mut |observer| {
            std::hint::black_box(observer.histograms());
        });
    }
    times.map(|time| time / scans.len().max(1) as f64)
}
