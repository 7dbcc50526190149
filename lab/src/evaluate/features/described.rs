//! Keypoints and descriptors of scans.

use std::time::Instant;

use agv_core::geometry::{Point, Pose};
use agv_core::sensing::falko::{Detector, Parameters, Sectors};
use agv_core::sensing::{Keypoint, PointScan};
use agv_places::{BinaryShapeContext, CumulativeGaussianHistogram, Kernel, OrthogonalCorners};
use serde::Serialize;

use crate::evaluate::falko::{BEAMS, KEYPOINTS, RANGES};
use agv_host_sim::import::PosedScan;
use agv_host_sim::recording::RecordedScan;

/// Radii of a descriptor, m: as printed (K 3.3.2), and as chosen on fr079 for both logs.
pub const DESCRIPTOR_RADII: [f32; 2] = [0.5, 1.0];
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
    /// Their binary shape contexts, by radius.
    pub shapes: [Vec<BinaryShapeContext>; 2],
    /// Their histograms, by radius.
    pub histograms: [Vec<CumulativeGaussianHistogram>; 2],
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
        Frame {
            keypoints: self.found.to_vec(),
            shapes: DESCRIPTOR_RADII.map(|radius| self.shapes(radius)),
            histograms: DESCRIPTOR_RADII.map(|radius| self.histograms(radius)),
        }
    }

    fn detect(&mut self) {
        match self.kind {
            DetectorKind::Falko => self.falko.detect(&self.points, &mut self.found),
            DetectorKind::Oc => self.corners.detect(&self.points, &mut self.found),
        };
    }

    fn shapes(&self, radius: f32) -> Vec<BinaryShapeContext> {
        let describe = |keypoint| BinaryShapeContext::describe(&self.points, keypoint, radius, &self.sectors);
        self.found.iter().map(describe).collect()
    }

    fn histograms(&self, radius: f32) -> Vec<CumulativeGaussianHistogram> {
        let describe = |keypoint| {
            CumulativeGaussianHistogram::describe(&self.points, keypoint, radius, &self.sectors, &self.kernel)
        };
        self.found.iter().map(describe).collect()
    }
}

/// Repetitions of a scan of which the fastest counts.
const REPETITIONS: usize = 8;

/// Times of detection, and of both descriptors by radius, of a scan, us, on one core.
#[must_use]
pub fn times(kind: DetectorKind, scans: &[PosedScan]) -> (f64, [[f64; 2]; 2]) {
    let mut observer = Observer::new(kind);
    let (mut detection, mut descriptors) = (0.0, [[0.0; 2]; 2]);
    let scans: Vec<_> = scans.iter().step_by((scans.len() / 256).max(1)).collect();
    let share = 1.0 / scans.len().max(1) as f64;
    for scan in &scans {
        observer.points.set(&scan.scan.view(), RANGES.0, RANGES.1);
        let mut measure = |time: &mut f64, work: &mut dyn FnMut(&mut Observer)| {
            work(&mut observer);
            let times = (0..REPETITIONS).map(|_| {
                let start = Instant::now();
                work(&mut observer);
                start.elapsed().as_secs_f64()
            });
            *time += share * 1e6 * times.fold(f64::INFINITY, f64::min);
        };
        measure(&mut detection, &mut Observer::detect);
        for (radius, times) in DESCRIPTOR_RADII.into_iter().zip(&mut descriptors) {
            measure(&mut times[0], &mut |observer| {
                std::hint::black_box(observer.shapes(radius));
            });
            measure(&mut times[1], &mut |observer| {
                std::hint::black_box(observer.histograms(radius));
            });
        }
    }
    (detection, descriptors)
}
