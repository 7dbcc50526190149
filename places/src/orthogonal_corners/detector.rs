//! The detector.

use heapless::Vec;

use super::HoughSpectrum;
use super::parameters::OrthogonalCornerParameters;
use super::surface_run::{RUNS, SurfaceRun, find};
use agv_core::geometry::ScanPoint;
use agv_core::sensing::{Keypoint, KeypointKind, PointScan};

/// Finds orthogonal corners; owns its scratch memory.
#[derive(Clone, Debug, Default)]
pub struct OrthogonalCorners {
    parameters: OrthogonalCornerParameters,
    spectrum: HoughSpectrum,
    along: Vec<SurfaceRun, RUNS>,
    across: Vec<SurfaceRun, RUNS>,
}

impl OrthogonalCorners {
    /// A detector with the given parameters.
    #[must_use]
    pub fn new(parameters: OrthogonalCornerParameters) -> Self {
        Self { parameters, ..Self::default() }
    }

    /// Replaces `keypoints` by the corners of `scan`, in the frame of its points. Returns how many did not fit.
    pub fn detect<const BEAMS: usize, const KEYPOINTS: usize>(
        &mut self,
        scan: &PointScan<BEAMS>,
        keypoints: &mut Vec<Keypoint, KEYPOINTS>,
    ) -> usize {
        keypoints.clear();
        let Some(direction) = self.spectrum.dominant_direction(scan) else { return 0 };
        let (sine, cosine) = libm::sincosf(direction);
        let axis = ScanPoint::new(cosine, sine);
        let normal = ScanPoint::new(-sine, cosine);
        find(scan, axis, &self.parameters, &mut self.along);
        find(scan, normal, &self.parameters, &mut self.across);
        let mut left_out = 0;
        for first in &self.along {
            for second in &self.across {
                if let Some(keypoint) = self.corner(first, second, axis, normal) {
                    left_out += usize::from(!self.keep(keypoint, keypoints));
                }
            }
        }
        left_out
    }

    /// The corner between a surface along `axis` and one along `normal`, if ends of both are near it.
    fn corner(&self, first: &SurfaceRun, second: &SurfaceRun, axis: ScanPoint, normal: ScanPoint) -> Option<Keypoint> {
        // A run along the normal counts its other coordinate against the axis.
        let (x, y) = (-second.across, first.across);
        let nearest = |run: &SurfaceRun, coordinate: f32| {
            let [a, b] = run.ends;
            let distance = |end: f32| libm::fabsf(end - coordinate);
            let end = if distance(a.along) <= distance(b.along) { a } else { b };
            (end.beam, distance(end.along))
        };
        let (beam, apart) = nearest(first, x);
        let (other_beam, other_apart) = nearest(second, y);
        if apart > self.parameters.reach || other_apart > self.parameters.reach {
            return None;
        }
        let bisector =
            axis * libm::copysignf(1.0, first.middle() - x) + normal * libm::copysignf(1.0, second.middle() - y);
        let deviation = self.parameters.range_deviation;
        let variance = |run: &SurfaceRun| deviation * deviation / f32::from(run.count.max(1));
        let (vx, vy) = (variance(second), variance(first));
        Some(Keypoint {
            kind: KeypointKind::Corner,
            beam: if apart <= other_apart { beam } else { other_beam },
            position: axis * x + normal * y,
            covariance: [
                axis.x * axis.x * vx + normal.x * normal.x * vy,
                axis.x * axis.y * vx + normal.x * normal.y * vy,
                axis.y * axis.y * vx + normal.y * normal.y * vy,
            ],
            orientation: libm::atan2f(bisector.y, bisector.x),
            radius: self.parameters.reach,
            score: apart + other_apart,
        })
    }

    /// Adds a corner unless a better one is near, and takes out the worse ones. False if there is no room.
    fn keep<const KEYPOINTS: usize>(&self, keypoint: Keypoint, keypoints: &mut Vec<Keypoint, KEYPOINTS>) -> bool {
        let square = self.parameters.suppression_radius * self.parameters.suppression_radius;
        let is_near = |other: &Keypoint| (other.position - keypoint.position).norm_squared() < square;
        if keypoints.iter().any(|other| is_near(other) && other.score <= keypoint.score) {
            return true;
        }
        keypoints.retain(|other| !is_near(other));
        keypoints.push(keypoint).is_ok()
    }
}
