//! The pose under which a scan lies on the surfaces of an earlier one: points to planes, iterated, robustly weighted.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use super::{PointToLine, PointView, SurfaceScan};
use crate::geometry::{Pose, ScanPoint, Transform};

/// A pose found by aligning scans.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScanAlignment {
    /// Pose of the source scan in the frame of the target.
    pub pose: Pose,
    /// Inverse of the covariance of `pose` (x, y, theta in the frame of the target) if points err independently.
    pub information: Matrix3<f64>,
    /// Root mean square distance of the points from the surfaces, m.
    pub residual: f64,
    /// Number of points that lie on surfaces.
    pub points: u32,
}

/// How a scan is aligned to surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SurfaceAlignmentParameters {
    /// Returns further from a piece of surface than this are not on it, m.
    pub reach: f32,
    /// Returns further in front of a surface, or behind it, than this weigh little, m.
    pub tolerance: f32,
    /// Number of iterations.
    pub iterations: u8,
    /// Every so many beams are looked at before the last iteration, in which all are.
    pub every: u8,
    /// Standard deviation of a range, m.
    pub range_deviation: f32,
    /// Standard deviation of a surface across itself, m.
    pub surface_deviation: f32,
}

impl Default for SurfaceAlignmentParameters {
    fn default() -> Self {
        Self { reach: 0.15, tolerance: 0.03, iterations: 3, every: 4, range_deviation: 0.01, surface_deviation: 0.004 }
    }
}

/// Fewest returns that fix a pose.
const FEWEST: u32 = 60;

/// Sectors to each side of a return's direction in which its surface is looked for.
const BESIDE: usize = 2;

/// Moves the source scan, which is taken to be at `start` in the frame of the target, to where its returns lie on the
/// target's surfaces. None if too few do, or if they fix no pose.
#[must_use]
pub fn align_to_surfaces<const DIRECTIONS: usize>(
    source: PointView<'_>,
    target: &SurfaceScan<DIRECTIONS>,
    start: &Pose,
    parameters: &SurfaceAlignmentParameters,
) -> Option<ScanAlignment> {
    let mut pose = *start;
    let mut outcome = None;
    let square_reach = parameters.reach * parameters.reach;
    let noise = parameters.range_deviation * parameters.range_deviation;
    let floor = parameters.surface_deviation * parameters.surface_deviation;
    let tolerance = 1.0 / (parameters.tolerance * parameters.tolerance);
    let iterations = parameters.iterations.max(1);
    for iteration in 1..=iterations {
        let every = if iteration < iterations { parameters.every.max(1) } else { 1 };
        let transform = Transform::of(&pose);
        let mut equations = PointToLine::default();
        let (mut squares, mut count) = (0.0_f32, 0);
        let returns = source.points.iter().zip(source.ranges).step_by(usize::from(every));
        for (point, range) in returns.filter(|(_, range)| **range > 0.0) {
            let moved = transform.apply(point);
            let Some((surface, square)) = target.nearest(&moved, BESIDE) else { continue };
            if square > square_reach {
                continue;
            }
            let normal = surface.normal;
            let distance = normal.dot(&(moved - surface.point));
            let lever: ScanPoint = moved - transform.shift();
            let slant = normal.dot(&lever) / range;
            let robust = 1.0 / (1.0 + distance * distance * tolerance);
            let weight = robust * robust / (noise * slant * slant + floor);
            equations.add(&normal, &lever, distance, weight);
            squares += weight * distance * distance;
            count += 1;
        }
        if count * u32::from(every) < FEWEST {
            return None;
        }
        pose = equations.step(&pose)?;
        let residual = libm::sqrt(f64::from(squares) / f64::from(count));
        outcome = Some(ScanAlignment { pose, information: equations.information, residual, points: count });
    }
    outcome.filter(|found| found.pose.is_finite())
}
