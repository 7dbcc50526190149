//! Whether a scan was taken at a stored place: keypoints suggest the pose, the scan decides.

use nalgebra::Matrix3;

use super::{
    Compatibility, CorrespondenceGraph, Overlap, OverlapParameters, ScanAlignmentParameters, align_scans,
    common_points, overlap, refine,
};
use agv_core::geometry::Pose;
use agv_core::sensing::{Keypoint, PointScan};

/// A scan and its keypoints.
#[derive(Debug)]
pub struct PlaceView<'a, const BEAMS: usize> {
    /// The scan.
    pub points: &'a PointScan<BEAMS>,
    /// Its keypoints.
    pub keypoints: &'a [Keypoint],
}

/// How a place is recognised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecognitionParameters {
    /// When two correspondences of keypoints can both be true.
    pub compatibility: Compatibility,
    /// Keypoints closer than this correspond once the scans are roughly aligned, m.
    pub refine_radius: f32,
    /// Keypoints closer than this in the end support the answer, m.
    pub common_radius: f32,
    /// RigidFit of the scans.
    pub alignment: ScanAlignmentParameters,
    /// RigidFit of the scans is not believed if it moves the pose further than this, m and rad.
    pub largest_correction: (f64, f64),
    /// Comparison of the scans.
    pub overlap: OverlapParameters,
}

impl Default for RecognitionParameters {
    fn default() -> Self {
        Self {
            compatibility: Compatibility { tolerance: 0.15, orientation: Some(0.5), same_kind: true, most_steps: 2000 },
            refine_radius: 0.25,
            common_radius: 0.2,
            alignment: ScanAlignmentParameters {
                first_reach: 0.3,
                last_reach: 0.1,
                iterations: 6,
                every: 2,
                range_deviation: 0.02,
            },
            largest_correction: (0.5, 0.17),
            overlap: OverlapParameters { near: 0.07, beyond: 0.2, every: 2 },
        }
    }
}

/// What may be said of a stored place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recognition {
    /// Pose of the query's sensor in the frame of the place.
    pub pose: Pose,
    /// Inverse of the covariance of `pose`, from the alignment of the scans; zero if they could not be aligned.
    pub information: Matrix3<f64>,
    /// Keypoints of the query that have one of the place near them.
    pub points: usize,
    /// What the scans say of each other.
    pub overlap: Overlap,
}

impl Recognition {
    /// How sure the answer is, 0 to 1: the share of agreement among the returns that could contradict, times the root
    /// of the share of all returns that agree. It does not depend on the number of keypoints.
    #[must_use]
    pub fn confidence(&self) -> f32 {
        let decided = self.overlap.agreeing + self.overlap.contradicting;
        if decided == 0 {
            return 0.0;
        }
        self.overlap.agreeing as f32 / decided as f32 * libm::sqrtf(self.overlap.share())
    }
}

/// Answers whether a scan was taken at a place; owns the memory of the search.
#[derive(Clone, Debug, Default)]
pub struct Recognizer<const VERTICES: usize = 512, const WORDS: usize = 16> {
    graph: CorrespondenceGraph<VERTICES, WORDS>,
}

impl<const VERTICES: usize, const WORDS: usize> Recognizer<VERTICES, WORDS> {
    /// The best pose of the query at the place. None if their keypoints do not correspond. Whether it is believed is the
    /// caller's decision, by [`Recognition::confidence`].
    pub fn recognise<const BEAMS: usize>(
        &mut self,
        query: &PlaceView<'_, BEAMS>,
        place: &PlaceView<'_, BEAMS>,
        parameters: &RecognitionParameters,
    ) -> Option<Recognition> {
        let (alignment, _) = self.graph.associate(query.keypoints, place.keypoints, &parameters.compatibility)?;
        let mut pose = alignment.pose;
        for _ in 0..2 {
            let refined = refine(query.keypoints, place.keypoints, &pose, parameters.refine_radius);
            pose = refined.map_or(pose, |refined| refined.pose);
        }
        let mut information = Matrix3::zeros();
        if let Some(aligned) = align_scans(query.points, place.points, &pose, &parameters.alignment) {
            let moved = pose.between(&aligned.pose);
            let (shift, turn) = parameters.largest_correction;
            if moved.position().norm() < shift && libm::fabs(moved.theta) < turn {
                pose = aligned.pose;
                information = aligned.information;
            }
        }
        Some(Recognition {
            pose,
            information,
            points: common_points(query.keypoints, place.keypoints, &pose, parameters.common_radius),
            overlap: overlap(query.points, place.points, &pose, &parameters.overlap),
        })
    }
}
