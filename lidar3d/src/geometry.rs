//! From a distance and an angle to a point, and back (M 3.2-3.6).

use crate::laser::Laser;

/// How the offsets of a beam are measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Offsets {
    /// Orthogonally to the beam (M 3.2.1).
    #[default]
    Orthogonal,
    /// V_o as a height above the plane z = 0, H_o in that plane (M 3.3.2.1).
    Alternate,
}

/// The far point of the two-point correction, m (HDL-64E S2 manual).
pub(crate) const FAR_POINT: f64 = 25.04;
/// Its near points along M's x and y, m.
const NEAR_POINT_X: f64 = 2.4;
const NEAR_POINT_Y: f64 = 1.93;

/// The derivatives of a point by D_corr, theta and alpha, in that order (M 3.8-3.16; the sign of 3.13 corrected).
pub type Jacobian = [[f64; 3]; 3];

/// The point that a laser sees, m. `azimuth` is the angle of the head, rad, clockwise seen from above; `distance` is the
/// measured one, m, before the correction.
#[must_use]
pub fn point(laser: &Laser, offsets: Offsets, azimuth: f64, distance: f64) -> [f64; 3] {
    let (forward, height) = side_view(laser, offsets, distance + laser.distance);
    let (sin, cos) = libm::sincos(azimuth - laser.rotation);
    let offset = laser.horizontal_offset;
    [forward * cos + offset * sin, offset * cos - forward * sin, height]
}

/// Distance from the axis, and height (M 3.3, 3.4).
fn side_view(laser: &Laser, offsets: Offsets, distance: f64) -> (f64, f64) {
    let (sin, cos) = libm::sincos(laser.elevation);
    let offset = laser.vertical_offset;
    match offsets {
        Offsets::Orthogonal => (distance * cos - offset * sin, distance * sin + offset * cos),
        Offsets::Alternate => (distance * cos, distance * sin + offset),
    }
}

/// As [`point`], with the near corrections of the maker's two-point model where the laser has them: each coordinate is
/// computed with its own correction, which blends into D_corr at 25.04 m.
#[must_use]
pub fn point_with_two_points(laser: &Laser, offsets: Offsets, azimuth: f64, distance: f64) -> [f64; 3] {
    let far = point(laser, offsets, azimuth, distance);
    let Some(full) = laser.full.filter(|full| full.has_two_points && distance + laser.distance < FAR_POINT) else {
        return far;
    };
    let near = near_corrections(laser.distance, [full.distance_x, full.distance_y], [far[0], far[1]]);
    let along = |correction| point(&Laser { distance: correction, ..*laser }, offsets, azimuth, distance);
    let [[_, y, _], [x, _, z]] = near.map(along);
    [x, y, z]
}

/// The distance corrections along M's x and y, m, of a point at `x` and `y` (this crate's): they blend from those at the
/// `near` points into the `far` one.
pub(crate) fn near_corrections(far: f64, near: [f64; 2], [x, y]: [f64; 2]) -> [f64; 2] {
    let blend =
        |near_point: f64, near: f64, at: f64| near + (far - near) * (at.abs() - near_point) / (FAR_POINT - near_point);
    [blend(NEAR_POINT_X, near[0], y), blend(NEAR_POINT_Y, near[1], x)]
}

/// Derivatives of [`point`]: of x, y and z, each by D_corr (1), theta and alpha (m/rad).
#[must_use]
pub fn jacobian(laser: &Laser, offsets: Offsets, azimuth: f64, distance: f64) -> Jacobian {
    let distance = distance + laser.distance;
    let (sin_elevation, cos_elevation) = libm::sincos(laser.elevation);
    let (sin, cos) = libm::sincos(azimuth - laser.rotation);
    let (forward, height) = side_view(laser, offsets, distance);
    let (forward_by_elevation, height_by_elevation) = match offsets {
        Offsets::Orthogonal => (-height, forward),
        Offsets::Alternate => (-distance * sin_elevation, distance * cos_elevation),
    };
    let offset = laser.horizontal_offset;
    [
        [cos_elevation * cos, forward_by_elevation * cos, forward * sin - offset * cos],
        [-cos_elevation * sin, -forward_by_elevation * sin, offset * sin + forward * cos],
        [sin_elevation, height_by_elevation, 0.0],
    ]
}

/// Derivatives of [`point`] by V_o and by H_o (1): of each, those of x, y and z.
#[must_use]
pub fn offset_jacobian(laser: &Laser, offsets: Offsets, azimuth: f64) -> [[f64; 3]; 2] {
    let (sin_elevation, cos_elevation) = libm::sincos(laser.elevation);
    let (sin, cos) = libm::sincos(azimuth - laser.rotation);
    let vertical = match offsets {
        Offsets::Orthogonal => [-sin_elevation * cos, sin_elevation * sin, cos_elevation],
        Offsets::Alternate => [0.0, 0.0, 1.0],
    };
    [vertical, [sin, cos, 0.0]]
}

/// Head angle, rad, and measured distance, m, at which a laser sees a point; for simulation. None for a point too near
/// to the axis for this beam. The point's height is not used: a beam reaches only the points of its own cone.
#[must_use]
pub fn inverse(laser: &Laser, offsets: Offsets, [x, y, _]: [f64; 3]) -> Option<(f64, f64)> {
    let squared = x * x + y * y - laser.horizontal_offset * laser.horizontal_offset;
    if squared <= 0.0 {
        return None;
    }
    let forward = libm::sqrt(squared);
    let (sin, cos) = libm::sincos(laser.elevation);
    let shift = match offsets {
        Offsets::Orthogonal => laser.vertical_offset * sin,
        Offsets::Alternate => 0.0,
    };
    let distance = (forward + shift) / cos;
    let azimuth = libm::atan2(laser.horizontal_offset, forward) - libm::atan2(y, x) + laser.rotation;
    Some((azimuth, distance - laser.distance))
}
