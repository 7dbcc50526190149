//! Scans of the distance behind that later scans are aligned to.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use super::status::SourceStatus;
use crate::filter::{Ekf, Empty, RelativePose, Slots, Storage, storage};
use crate::geometry::{Pose, difference};
use crate::maps::Verdict;
use crate::measurement::Time;
use crate::sensing::{PointView, SurfaceAlignmentParameters, SurfaceParameters, SurfaceScan, align_to_surfaces};

/// How scans are aligned to key scans.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct KeyScanParameters {
    /// Distance after which a scan becomes a key scan, m.
    pub spacing: f64,
    /// Turn after which it does, rad.
    pub turn: f64,
    /// How a key scan's surfaces are found.
    pub surfaces: SurfaceParameters,
    /// How scans are aligned to them.
    pub alignment: SurfaceAlignmentParameters,
    /// Least share of a scan's returns that must lie on a key scan's surfaces.
    pub least_share: f64,
    /// By what the covariance of an alignment is multiplied that takes returns as independent.
    pub inflation: f64,
    /// Standard deviation that is added along each axis, m.
    pub position_floor: f64,
    /// The same for the heading, rad.
    pub heading_floor: f64,
    /// Largest squared Mahalanobis distance from what is expected, chi-square with three degrees of freedom.
    pub gate: f64,
}

impl Default for KeyScanParameters {
    /// Inflation and floors of the project's feasibility study; the gate lets 99.9 per cent of the right ones pass.
    fn default() -> Self {
        Self {
            spacing: 1.5,
            turn: 0.35,
            surfaces: SurfaceParameters::default(),
            alignment: SurfaceAlignmentParameters::default(),
            least_share: 0.25,
            inflation: 12.0,
            position_floor: 0.5e-3,
            heading_floor: 0.9e-4,
            gate: 16.3,
        }
    }
}

/// Sectors of a key scan.
const DIRECTIONS: usize = 720;

impl Empty for SurfaceScan<DIRECTIONS> {
    const EMPTY: Self = Self::new();
}

/// The surfaces that were seen at the past poses of the state.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(bound = "")]
pub(crate) struct KeyScans<S: Slots> {
    #[serde(with = "storage")]
    surfaces: S::PerPose<SurfaceScan<DIRECTIONS>>,
    /// Place of the newest one; places are taken in turn.
    newest: usize,
}

impl<S: Slots> KeyScans<S> {
    #[inline(always)]
    pub(crate) fn new() -> Self {
        Self { surfaces: S::PerPose::empty(), newest: 0 }
    }

    pub(crate) fn clear(&mut self) {
        self.newest = 0;
    }

    /// Corrects the filter, which stands at `time`, by what the scan says of the distance since each key scan.
    pub(crate) fn align(
        &self,
        filter: &mut Ekf<S>,
        points: PointView<'_>,
        place: &Pose,
        laser: &Pose,
        parameters: &KeyScanParameters,
        (time, status): (Time, &mut SourceStatus),
    ) {
        let returns = points.ranges.iter().filter(|range| **range > 0.0).count();
        let from_place = place.inverse();
        for (key, surfaces) in self.surfaces.as_ref().iter().enumerate() {
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
            let Some(root) = covariance.cholesky() else { continue };
            let test_ratio = observation.residual.dot(&root.solve(&observation.residual)) / parameters.gate;
            let is_used = test_ratio <= 1.0 && filter.correct(&observation);
            let verdict = if is_used { Verdict::Accepted } else { Verdict::Gated };
            status.add(time, verdict, is_used, Some(test_ratio));
        }
    }

    /// Makes the scan a key scan if the vehicle has come far enough from the newest one; it takes the place of the oldest.
    pub(crate) fn keep(
        &mut self,
        filter: &mut Ekf<S>,
        points: PointView<'_>,
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
        let places = self.surfaces.as_mut();
        let next = self.newest.wrapping_add(1);
        let next = if next < places.len() { next } else { 0 };
        if let Some(surfaces) = places.get_mut(next) {
            surfaces.set(points, place, &parameters.surfaces);
            filter.remember_pose(next);
            self.newest = next;
        }
    }
}
