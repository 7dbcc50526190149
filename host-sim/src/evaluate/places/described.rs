//! A scan with all that is computed of it once.

use agv_core::features::falko::{Detector, Parameters};
use agv_core::features::{Keypoint, PointScan};
use agv_core::geometry::{Pose, ScanPoint};
use agv_core::measurement::Time;

use crate::evaluate::falko::{BEAMS, KEYPOINTS, RANGES};
use crate::import::PosedScan;

/// A scan as points and keypoints, and where it was taken.
#[derive(Clone, Debug)]
pub struct DescribedScan {
    /// Points.
    pub points: Box<PointScan<BEAMS>>,
    /// Keypoints.
    pub keypoints: Vec<Keypoint>,
    /// When it was taken.
    pub time: Time,
    /// Pose of the laser, corrected; not for the method's eyes.
    pub laser: Pose,
}

impl DescribedScan {
    /// Describes scans with one set of parameters.
    #[must_use]
    pub fn all(scans: &[PosedScan], parameters: Parameters) -> Vec<Self> {
        let mut detector = Box::new(Detector::<BEAMS>::new(parameters));
        let described = scans.iter().map(|scan| {
            let mut points = Box::new(PointScan::<BEAMS>::new());
            points.set(&scan.scan.view(), RANGES.0, RANGES.1);
            let mut keypoints = heapless::Vec::<Keypoint, KEYPOINTS>::new();
            detector.detect(&points, &mut keypoints);
            Self { points, keypoints: keypoints.to_vec(), time: scan.scan.start, laser: scan.laser }
        });
        described.collect()
    }

    /// Positions of the keypoints, m.
    #[must_use]
    pub fn positions(&self) -> Vec<ScanPoint> {
        self.keypoints.iter().map(|keypoint| keypoint.position).collect()
    }
}
