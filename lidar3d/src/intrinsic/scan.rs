//! What was seen of a calibration target.

use std::vec::Vec;

use super::Plane;
use crate::calibration::Laser;
use crate::geometry::{Offsets, point};

/// One return, as the sensor measured it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Return {
    /// Number of the laser.
    pub laser: usize,
    /// Angle of the head, rad, clockwise seen from above.
    pub azimuth: f64,
    /// Measured distance without correction, m.
    pub distance: f64,
}

impl Return {
    /// Where it lies; None if there is no such laser.
    #[must_use]
    pub fn point(&self, lasers: &[Laser], offsets: Offsets) -> Option<[f64; 3]> {
        Some(point(lasers.get(self.laser)?, offsets, self.azimuth, self.distance))
    }
}

/// The returns of one scan that lie on a plane, or nearly.
#[derive(Clone, Debug)]
pub struct Target {
    /// Those on the plane.
    pub returns: Vec<Return>,
    /// The plane, as well as it is known.
    pub plane: Plane,
}

/// How flat a plane looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flatness {
    /// Sum of the squared distances to the plane of best fit, m^2 (M table 3.3).
    pub sum_of_squares: f64,
    /// Number of points.
    pub points: usize,
}

impl Flatness {
    /// Root of the mean squared distance, m: the root of cost 3.7.
    #[must_use]
    pub fn thickness(&self) -> f64 {
        libm::sqrt(self.sum_of_squares / self.points.max(1) as f64)
    }
}

/// Fits a plane to returns and measures how far they lie from it; None for fewer than three.
#[must_use]
pub fn flatness(lasers: &[Laser], offsets: Offsets, returns: &[Return]) -> Option<Flatness> {
    let points: Vec<[f64; 3]> = returns.iter().filter_map(|seen| seen.point(lasers, offsets)).collect();
    let plane = Plane::fit(points.iter().copied())?;
    let sum_of_squares = points.iter().map(|point| plane.distance_of(*point).powi(2)).sum();
    Some(Flatness { sum_of_squares, points: points.len() })
}
