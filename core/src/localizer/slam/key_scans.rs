//! Scans of the way behind that later scans are aligned to.

use nalgebra::Matrix3;

use crate::filter::{Ekf, RelativePose, Slots};
use crate::geometry::{Pose, difference};
use crate::sensing::PointScan;
use crate::sensing::{SurfaceScan, align_to_surfaces};

use super::KeyScanParameters;

/// Sectors of a key scan.
const DIRECTIONS: usize = 720;

/// The surfaces that were seen at the past poses of the state.
#[derive(Clone, Debug)]
pub(super) struct KeyScans<const KEYS: usize> {
    surfaces: [SurfaceScan<DIRECTIONS>; KEYS],
    /// Place of the newest one; places are taken in turn.
    newest: usize,
}

impl<const KEYS: usize> KeyScans<KEYS> {
    #[inline(always)]
    pub(super) const fn new() -> Self {
        Self { surfaces: [const { SurfaceScan::new() }; KEYS], newest: 0 }
    }

    pub(super) fn clear(&mut self) {
        self.newest = 0;
    }

    /// Corrects the filter by what the scan says of the way since each key scan.
    pub(super) fn align<const BEAMS: usize, S: Slots>(
        &self,
        filter: &mut Ekf<S>,
        points: &PointScan<BEAMS>,
        place: &Pose,
        laser: &Pose,
        parameters: &KeyScanParameters,
    ) {
        let returns = points.ranges.iter().filter(|range| **range > 0.0).count();
        let from_place = place.inverse();
        for (key, surfaces) in self.surfaces.iter().enumerate() {
            let Some(expected) = filter.expected_relative_pose(key, laser) else { continue };
            let start = expected.compose(&from_place);
            let Some(found) = align_to_surfaces(points, surfaces, &start, &parameters.alignment) else { continue };
            if f64::from(found.points) < parameters.least_share * returns as f64 {
                continue;
            }
            let Some(covariance) = found.information.try_inverse() else { continue };
            let jacobian = found.pose.compose_jacobian_first(place);
            let seen = RelativePose {
                pose: found.pose.compose(place),
                covariance: jacobian * covariance * jacobian.transpose() * parameters.inflation
                    + Matrix3::from_diagonal(&nalgebra::Vector3::new(
                        parameters.position_floor * parameters.position_floor,
                        parameters.position_floor * parameters.position_floor,
                        parameters.heading_floor * parameters.heading_floor,
                    )),
            };
            let Some(observation) = filter.observe_relative_pose(key, &seen, laser) else { continue };
            let covariance = filter.residual_covariance(&observation);
            let is_plausible = covariance
                .cholesky()
                .is_some_and(|root| observation.residual.dot(&root.solve(&observation.residual)) <= parameters.gate);
            if is_plausible {
                filter.correct(&observation);
            }
        }
    }

    /// Makes the scan a key scan if the vehicle has come far enough from the newest one; it takes the place of the oldest.
    pub(super) fn keep<const BEAMS: usize, S: Slots>(
        &mut self,
        filter: &mut Ekf<S>,
        points: &PointScan<BEAMS>,
        place: &Pose,
        parameters: &KeyScanParameters,
    ) {
        let pose = filter.pose;
        let is_needed = filter.past_pose(self.newest).is_none_or(|newest| {
            libm::hypot(pose.x - newest.x, pose.y - newest.y) > parameters.spacing
                || libm::fabs(difference(pose.theta, newest.theta)) > parameters.turn
        });
        if !is_needed {
            return;
        }
        let next = if self.newest + 1 < KEYS { self.newest + 1 } else { 0 };
        if let Some(surfaces) = self.surfaces.get_mut(next) {
            surfaces.set(points, place, &parameters.surfaces);
            filter.remember_pose(next);
            self.newest = next;
        }
    }
}
