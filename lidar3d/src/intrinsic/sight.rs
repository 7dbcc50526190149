//! Where a return lies to its plane.

use nalgebra::{Matrix3, SVector, Vector3};

use super::{Plane, Residual, Return};
use crate::calibration::Laser;
use crate::geometry::{Offsets, jacobian, offset_jacobian};

/// Parameters of a laser: D_corr, theta, alpha, V_o and H_o.
pub(super) const OF_LASER: usize = 5;
/// Those of a plane: two turns, its distance, and how much too long the ranges of its scan are.
pub(super) const OF_PLANE: usize = 4;

pub(super) type LaserVector = SVector<f64, OF_LASER>;
pub(super) type PlaneVector = SVector<f64, OF_PLANE>;

/// Sine of the angle at which a beam meets its plane: from 12 deg downwards points count less, below 6 deg not at all.
const OBLIQUE: [f64; 2] = [0.1, 0.2];

/// Where a return lies to its plane.
pub(super) struct Sight {
    /// From the plane, m.
    pub residual: f64,
    /// The residual's derivatives by the laser's parameters.
    pub by_laser: LaserVector,
    /// The same by the plane's.
    pub by_plane: PlaneVector,
    /// The same by the range.
    pub by_range: f64,
    /// Between 0 and 1.
    pub weight: f64,
}

impl Sight {
    /// Of a return whose range is `bias` too long, m. None if there is no such laser, or the beam only grazes the plane.
    pub(super) fn new(
        lasers: &[Laser],
        offsets: Offsets,
        kind: Residual,
        seen: &Return,
        (plane, bias): (&Plane, f64),
    ) -> Option<Self> {
        let laser = lasers.get(seen.laser)?;
        let normal = Vector3::from(plane.normal);
        let distance = seen.distance - bias;
        // Their columns are the rows of the Jacobian.
        let derivatives = |distance| Matrix3::from(jacobian(laser, offsets, seen.azimuth, distance));
        let point = Vector3::from(crate::geometry::point(laser, offsets, seen.azimuth, distance));
        let perpendicular = plane.distance_of(point.into());
        let [vertical, horizontal] = offset_jacobian(laser, offsets, seen.azimuth).map(Vector3::from);
        let by_offsets = [vertical.dot(&normal), horizontal.dot(&normal)];
        let beam = derivatives(distance).row(0).transpose();
        let incidence = beam.dot(&normal);
        let [first, second] = plane.directions();
        let sight = |residual: f64, main: Vector3<f64>, by_normal: Vector3<f64>, scale: f64, weight: f64| Self {
            residual,
            by_laser: LaserVector::new(main[0], main[1], main[2], by_offsets[0] / scale, by_offsets[1] / scale),
            by_plane: PlaneVector::new(first.dot(&by_normal), second.dot(&by_normal), -1.0 / scale, -incidence / scale),
            by_range: incidence / scale,
            weight,
        };
        match kind {
            Residual::Perpendicular => Some(sight(perpendicular, derivatives(distance) * normal, point, 1.0, 1.0)),
            Residual::AlongBeam => {
                let [least, full] = OBLIQUE;
                if incidence.abs() < least {
                    return None;
                }
                // Where the beam meets the plane: derivatives there do not carry the noise of the distance.
                let residual = perpendicular / incidence;
                let main = derivatives(distance - residual) * normal / incidence;
                let by_normal = (point - beam * residual) / incidence;
                let weight = ((incidence.abs() - least) / (full - least)).min(1.0);
                Some(sight(residual, main, by_normal, incidence, weight))
            }
        }
    }
}
