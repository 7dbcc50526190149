//! Natural features of a scan: corners and end points of contours.

use core::fmt::Debug;

use heapless::Vec;
use nalgebra::Matrix2;
use serde::{Deserialize, Serialize};

use super::sighting::{OBSERVATIONS, Sighting, Workspace};
use super::{Source, Switches};
use crate::filter::{Cartesian, Observation};
use crate::geometry::{Point, Pose};
use crate::maps::{LandmarkKind, Verdict};
use crate::measurement::Scan;
use crate::order::insertion_sort_by;
use crate::sensing::{Keypoint, KeypointKind, PointScan, PointView, SensorPath, falko};

/// How natural features are seen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FeatureParameters {
    /// How they are found.
    pub detector: falko::Parameters,
    /// Nearest range that counts, m.
    pub nearest: f32,
    /// Farthest range that counts, m.
    pub farthest: f32,
    /// Standard deviation that is added to what the detector states, along each axis, m.
    pub added_deviation: f64,
    /// Whether the scan is corrected for the motion of the vehicle within the revolution.
    pub motion_correction: bool,
}

impl Default for FeatureParameters {
    fn default() -> Self {
        Self {
            detector: falko::Parameters::default(),
            nearest: 0.5,
            farthest: 30.0,
            added_deviation: 0.01,
            motion_correction: true,
        }
    }
}

/// Finds natural features in scans of up to `BEAMS` beams.
#[derive(Clone, Debug)]
pub struct FeatureFinder<const BEAMS: usize> {
    points: PointScan<BEAMS>,
    detector: falko::Detector<BEAMS>,
    keypoints: Vec<Keypoint, OBSERVATIONS>,
}

/// A [`FeatureFinder`] of any capacity.
pub trait FindFeatures: Clone + Debug {
    /// Beams of a scan, at the most.
    const BEAMS: usize;

    /// One that has seen nothing.
    fn new(detector: falko::Parameters) -> Self;

    /// The points of the last scan.
    fn points(&self) -> PointView<'_>;

    /// Takes the points of a scan, as they would be seen from the first beam's place. True if there was not room for all beams.
    fn take(&mut self, path: &SensorPath, features: &FeatureParameters, scan: &Scan) -> bool;

    /// Finds the natural features of the scan that was taken. They are found in the scan as it would look from the first beam's place,
    /// and observed from where the sensor was at their own beam. Their covariance is not turned between the two. True if there
    /// was not room for all.
    fn find(
        &mut self,
        workspace: &mut Workspace,
        features: &FeatureParameters,
        switches: &Switches,
        mount: &Pose,
        scan: &Scan,
    ) -> bool;
}

impl<const BEAMS: usize> FindFeatures for FeatureFinder<BEAMS> {
    const BEAMS: usize = BEAMS;

    #[inline(always)]
    fn new(detector: falko::Parameters) -> Self {
        Self { points: PointScan::new(), detector: falko::Detector::new(detector), keypoints: Vec::new() }
    }

    #[inline]
    fn points(&self) -> PointView<'_> {
        self.points.view()
    }

    fn take(&mut self, path: &SensorPath, features: &FeatureParameters, scan: &Scan) -> bool {
        self.points.set(scan, features.nearest, features.farthest);
        if features.motion_correction {
            path.correct(scan, &mut self.points);
        }
        PointScan::<BEAMS>::stride(scan) > 1
    }

    fn find(
        &mut self,
        workspace: &mut Workspace,
        features: &FeatureParameters,
        switches: &Switches,
        mount: &Pose,
        scan: &Scan,
    ) -> bool {
        let stride = PointScan::<BEAMS>::stride(scan);
        self.keypoints.clear();
        let is_wanted = switches.corners || switches.end_points;
        let left_out = if is_wanted { self.detector.detect(&self.points, &mut self.keypoints) } else { 0 };
        insertion_sort_by(&mut self.keypoints, |a, b| a.beam.cmp(&b.beam));
        workspace.sightings.clear();
        let added = features.added_deviation * features.added_deviation;
        for keypoint in &self.keypoints {
            let beam = usize::from(keypoint.beam) * stride;
            let position = Point::new(f64::from(keypoint.position.x), f64::from(keypoint.position.y));
            let position = if features.motion_correction {
                workspace.path.from_start(beam as f64 * scan.beam_interval, &position)
            } else {
                position
            };
            let [xx, xy, yy] = keypoint.covariance.map(f64::from);
            let kind = match keypoint.kind {
                KeypointKind::Corner => LandmarkKind::Corner,
                KeypointKind::EndPoint => LandmarkKind::EndPoint,
            };
            if !switches.of(Source::of_landmark(kind)) {
                continue;
            }
            let _ = workspace.sightings.push(Sighting {
                time: scan.beam_time(beam),
                laser: scan.laser,
                mount: *mount,
                kind,
                observation: Observation::Cartesian(Cartesian {
                    position,
                    covariance: Matrix2::new(xx + added, xy, xy, yy + added),
                }),
                orientation: keypoint.orientation,
                matched: None,
                verdict: Verdict::Unknown,
            });
        }
        left_out > 0
    }
}
