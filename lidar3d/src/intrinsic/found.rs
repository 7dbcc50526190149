//! A calibration that was found, and how well it is known.

use std::vec::Vec;

use super::normal_equations::LaserMatrix;
use super::sight::LaserVector;
use crate::calibration::Laser;
use crate::geometry::{Offsets, jacobian, offset_jacobian};

/// A parameter whose deviation is not below this part of that of the start is held at the factory's value, as good as.
const HELD: f64 = 0.7;
/// At which distance a calibration is judged, m.
const JUDGED_AT: f64 = 10.0;

/// Standard deviations of one laser's parameters, against the gauge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Of D_corr, m.
    pub distance: f64,
    /// Of theta, rad.
    pub elevation: f64,
    /// Of alpha, rad; the mean of all alpha is held.
    pub rotation: f64,
    /// Of V_o, m.
    pub vertical_offset: f64,
    /// Of H_o, m.
    pub horizontal_offset: f64,
}

impl Deviation {
    /// Those that a factory's values are believed to have: 2 cm, 0.1 deg, 0.3 deg, and 5 mm of the offsets.
    pub const FACTORY: Self = Self {
        distance: 0.02,
        elevation: 0.1 * core::f64::consts::PI / 180.0,
        rotation: 0.3 * core::f64::consts::PI / 180.0,
        vertical_offset: 0.005,
        horizontal_offset: 0.005,
    };

    pub(super) fn vector(&self) -> LaserVector {
        let Self { distance, elevation, rotation, vertical_offset, horizontal_offset } = *self;
        LaserVector::new(distance, elevation, rotation, vertical_offset, horizontal_offset)
    }

    pub(super) fn of_vector(vector: LaserVector) -> Self {
        let [distance, elevation, rotation, vertical_offset, horizontal_offset] = vector.into();
        Self { distance, elevation, rotation, vertical_offset, horizontal_offset }
    }
}

/// Which parameters of a laser the scans hardly show, so that they are the factory's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Held {
    /// D_corr.
    pub distance: bool,
    /// Theta.
    pub elevation: bool,
    /// Alpha.
    pub rotation: bool,
    /// V_o.
    pub vertical_offset: bool,
    /// H_o.
    pub horizontal_offset: bool,
}

/// A calibration found.
#[derive(Clone, Debug)]
pub struct Adjustment {
    /// The lasers; those that were not observed are as at the start.
    pub lasers: Vec<Laser>,
    /// How well each is known; None for a laser that was not observed.
    pub deviations: Vec<Option<Deviation>>,
    /// Standard deviation of the residuals, m.
    pub noise: f64,
    /// Standard deviation of the error that the ranges of one laser on one target have together, m.
    pub range_error: f64,
    /// By how much all ranges of each target's scan are too long, m, as far as the targets contradict each other.
    pub common_range_errors: Vec<f64>,
    /// Rounds that it took.
    pub rounds: usize,
    /// How far the values of the start are off, as the scans of all lasers together tell: standard deviations.
    pub start_deviation: Deviation,
    pub(super) covariances: Vec<Option<LaserMatrix>>,
}

impl Adjustment {
    /// Which parameters of a laser are the factory's, as the scans hardly show them. Of a laser that was not observed, all.
    #[must_use]
    pub fn held(&self, laser: usize) -> Held {
        let Some(found) = self.deviations.get(laser).copied().flatten() else {
            return Held {
                distance: true,
                elevation: true,
                rotation: true,
                vertical_offset: true,
                horizontal_offset: true,
            };
        };
        let [distance, elevation, rotation, vertical_offset, horizontal_offset] =
            found.vector().zip_map(&self.start_deviation.vector(), |found, start| found > HELD * start).into();
        Held { distance, elevation, rotation, vertical_offset, horizontal_offset }
    }

    /// Standard deviation of the place of a point that a laser sees at a distance, m, all three coordinates together,
    /// without the noise of its range. None for a laser that was not observed.
    #[must_use]
    pub fn point_deviation(&self, laser: usize, offsets: Offsets, distance: f64) -> Option<f64> {
        let covariance = self.covariances.get(laser)?.as_ref()?;
        Some(point_deviation(self.lasers.get(laser)?, offsets, distance, covariance))
    }
}

impl Adjustment {
    /// Deviation of the points at 10 m, as a part of that with the factory's values.
    pub(super) fn part_left(&self, offsets: Offsets) -> f64 {
        let before = LaserMatrix::from_diagonal(&Deviation::FACTORY.vector().map(|deviation| deviation * deviation));
        let (mut left, mut known) = (0.0, 0.0);
        for (laser, covariance) in self.lasers.iter().zip(&self.covariances) {
            let Some(covariance) = covariance else { continue };
            left += point_deviation(laser, offsets, JUDGED_AT, covariance).powi(2);
            known += point_deviation(laser, offsets, JUDGED_AT, &before).powi(2);
        }
        (left / known).sqrt()
    }
}

fn point_deviation(laser: &Laser, offsets: Offsets, distance: f64, covariance: &LaserMatrix) -> f64 {
    let ahead = laser.rotation;
    let main = jacobian(laser, offsets, ahead, distance - laser.distance);
    let [vertical, horizontal] = offset_jacobian(laser, offsets, ahead);
    let variance = |axis: usize| {
        let [distance, elevation, rotation] = main[axis];
        let by = LaserVector::new(distance, elevation, rotation, vertical[axis], horizontal[axis]);
        by.dot(&(covariance * by))
    };
    (0..3).map(variance).sum::<f64>().max(0.0).sqrt()
}
