//! The pose by laser odometry, since landmarks told it: it holds if the odometry of the wheels is wrong by whatever, and at once.

use super::assumed::Factors;
use super::envelope::{Bound, SolutionBound};
use super::sensor_information::not_negative;
use crate::geometry::{Pose, difference, larger_axis};
use crate::sources::BySurfaces;

/// Random walk of laser odometry: m and rad for a square root of a metre. In simulated aisles of racks it is 8 mm and 0.1 deg off
/// behind 8 m, in 95 % of the scans.
const DRIFT: [f64; 2] = [0.005, 0.001];

/// Where surfaces did not show how the laser has moved, or landmarks say that it may have moved otherwise, it is taken to be off by so much at
/// the most, m and rad: more than any alert limit.
pub const TORN: [f64; 2] = [1.5, 0.6];

/// The bound of a pose by it; landmarks had told that with that covariance, to which the odometry has added its own.
#[must_use]
pub fn bound(by_surfaces: &BySurfaces, pose: &Pose, covariance: &[f64; 6], factors: &Factors) -> SolutionBound {
    let [xx, xy, yy, _, _, heading] = *covariance;
    let [drift, turn] = DRIFT.map(|deviation| deviation * deviation * by_surfaces.distance);
    let [torn, torn_turn] = if by_surfaces.is_torn { TORN } else { [0.0; 2] };
    let (x, y) = (by_surfaces.pose.x - pose.x, by_surfaces.pose.y - pose.y);
    SolutionBound {
        position: Bound {
            apart: libm::hypot(x, y) + torn,
            variance: larger_axis(xx, xy, yy) + drift,
            factor: factors.position,
        },
        heading: Bound {
            apart: libm::fabs(difference(by_surfaces.pose.theta, pose.theta)) + torn_turn,
            variance: heading + turn,
            factor: factors.heading,
        },
    }
}

/// The bound of a pose by it if the odometry of the wheels is wrong, which had bounded the pose by `told` when landmarks last told it. None where
/// the wheels have led it.
#[must_use]
pub fn bound_without_wheels(
    by_surfaces: &BySurfaces,
    pose: &Pose,
    told: &SolutionBound,
    factors: &Factors,
) -> Option<SolutionBound> {
    if by_surfaces.is_torn || by_surfaces.is_led_by_wheels {
        return None;
    }
    let distance = by_surfaces.distance;
    let [drift, turn] = DRIFT.map(|deviation| deviation * deviation * distance);
    let SolutionBound { position, heading } = told;
    let (x, y) = (by_surfaces.pose.x - pose.x, by_surfaces.pose.y - pose.y);
    // What the heading was wrong by has led away over the distance since.
    let deviation = libm::sqrt(not_negative(position.variance)) + libm::sqrt(not_negative(heading.variance)) * distance;
    Some(SolutionBound {
        position: Bound {
            apart: position.apart + heading.apart * distance + libm::hypot(x, y),
            variance: deviation * deviation + drift,
            factor: factors.position,
        },
        heading: Bound {
            apart: heading.apart + libm::fabs(difference(by_surfaces.pose.theta, pose.theta)),
            variance: heading.variance + turn,
            factor: factors.heading,
        },
    })
}
