//! How well a pose is determined by the surfaces that did not move: the information matrix of their true distances.

use agv_core::geometry::Pose;
use agv_host_sim::simulate::raycast::RayCaster;
use nalgebra::{Matrix3, Vector3};

use super::survey::{BEAMS, RANGE_NOISE, distance};

/// Differences are taken over so much to each side, m and rad.
const STEP: (f64, f64) = (1e-4, 1e-5);

/// A beam whose distance changes by more than so many metres a metre, or a hundred times that a radian, is at an edge.
const EDGE: f64 = 30.0;

/// A beam ends at a surface of both worlds if its distances differ by no more than this, m.
const SAME: f64 = 1e-6;

/// Standard deviations of the position (along the axis on which it is worst), m, and of the heading, rad, of a laser at `pose` in `now`,
/// of which `unmoved` has what did not move. Infinite if they do not determine it.
pub(super) fn deviations(now: &RayCaster, unmoved: &RayCaster, pose: &Pose) -> (f64, f64) {
    let mut information = Matrix3::zeros();
    for beam in 0..BEAMS {
        let (Some(seen), Some(known)) = (distance(now, pose, beam), distance(unmoved, pose, beam)) else { continue };
        if (seen - known).abs() > SAME {
            continue;
        }
        let slope = |x: f64, y: f64, theta: f64, step: f64| {
            let at = |by: f64| Pose::new(pose.x + by * x, pose.y + by * y, pose.theta + by * theta);
            Some((distance(unmoved, &at(step), beam)? - distance(unmoved, &at(-step), beam)?) / (2.0 * step))
        };
        let slopes = [slope(1.0, 0.0, 0.0, STEP.0), slope(0.0, 1.0, 0.0, STEP.0), slope(0.0, 0.0, 1.0, STEP.1)];
        let [Some(x), Some(y), Some(theta)] = slopes else { continue };
        if x.abs().max(y.abs()).max(0.01 * theta.abs()) <= EDGE {
            let row = Vector3::new(x, y, theta) / RANGE_NOISE;
            information += row * row.transpose();
        }
    }
    let Some(covariance) = information.try_inverse() else { return (f64::INFINITY, f64::INFINITY) };
    let position = covariance.fixed_view::<2, 2>(0, 0).into_owned().symmetric_eigenvalues().max();
    (position.sqrt(), covariance.m33.sqrt())
}
