//! A scan with all that is computed of it once.

use agv_core::geometry::{Pose, ScanPoint};
use agv_core::measurement::Time;
use agv_core::sensing::falko::{Detector, Parameters};
use agv_core::sensing::{Keypoint, PointScan};
use agv_places::CumulativeGaussianHistogram;

use super::chain::histograms;
use crate::evaluate::falko::{BEAMS, KEYPOINTS, RANGES};
use agv_host_sim::import::PosedScan;

/// A scan as points and keypoints, and where it was taken.
#[derive(Clone, Debug)]
pub struct DescribedScan {
    /// Points.
    pub points: Box<PointScan<BEAMS>>,
    /// Keypoints.
    pub keypoints: Vec<Keypoint>,
    /// Descriptors of the keypoints.
    pub histograms: Vec<CumulativeGaussianHistogram>,
    /// When it was taken.
    pub time: Time,
    /// Pose of the laser, corrected; not for the method's eyes.
    pub laser: Pose,
}

impl DescribedScan {
    /// Describes scans with the keypoints of all these detectors.
    #[must_use]
    pub fn all(scans: &[PosedScan], parameters: &[Parameters]) -> Vec<Self> {
        let mut detectors: Vec<_> =
            parameters.iter().map(|parameters| Box::new(Detector::<BEAMS>::new(*parameters))).collect();
        let described = scans.iter().map(|scan| {
            let mut points = Box::new(PointScan::<BEAMS>::new());
            points.set(&scan.scan.view(), RANGES.0, RANGES.1);
            let mut keypoints = Vec::new();
            let mut found = heapless::Vec::<Keypoint, KEYPOINTS>::new();
            for detector in &mut detectors {
                detector.detect(&points, &mut found);
                keypoints.extend_from_slice(&found);
            }
            let time = scan.scan.start;
            let mut described = Self { points, keypoints, histograms: Vec::new(), time, laser: scan.laser };
            described.histograms = histograms(&described);
            described
        });
        described.collect()
    }

    /// Positions of the keypoints, m.
    #[must_use]
    pub fn positions(&self) -> Vec<ScanPoint> {
        self.keypoints.iter().map(|keypoint| keypoint.position).collect()
    }
}
