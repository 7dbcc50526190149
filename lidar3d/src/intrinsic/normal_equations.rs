//! The normal equations of all lasers and planes, with the planes eliminated.
//!
//! A residual couples one laser and one plane only, so each plane can be eliminated by a matrix of four by four; what
//! remains has five unknowns a laser.

use std::vec;
use std::vec::Vec;

use nalgebra::{DMatrix, DVector, SMatrix};

use super::sight::{LaserVector, OF_LASER, OF_PLANE, PlaneVector, Sight};

pub(super) type LaserMatrix = SMatrix<f64, OF_LASER, OF_LASER>;
type PlaneMatrix = SMatrix<f64, OF_PLANE, OF_PLANE>;
type MixedMatrix = SMatrix<f64, OF_LASER, OF_PLANE>;

/// Place of alpha among the parameters of a laser.
const ROTATION: usize = 2;

/// What one plane and one laser share.
#[derive(Clone, Copy)]
struct Shared {
    laser: LaserMatrix,
    mixed: MixedMatrix,
    plane: PlaneMatrix,
    laser_gradient: LaserVector,
    plane_gradient: PlaneVector,
    /// Sums of the derivatives by the range, with those by the laser, by the plane, with the residual and with itself.
    range_laser: LaserVector,
    range_plane: PlaneVector,
    range_residual: f64,
    range: f64,
}

impl Default for Shared {
    fn default() -> Self {
        Self {
            laser: LaserMatrix::zeros(),
            mixed: MixedMatrix::zeros(),
            plane: PlaneMatrix::zeros(),
            laser_gradient: LaserVector::zeros(),
            plane_gradient: PlaneVector::zeros(),
            range_laser: LaserVector::zeros(),
            range_plane: PlaneVector::zeros(),
            range_residual: 0.0,
            range: 0.0,
        }
    }
}

/// The sums over the points of one plane.
pub(super) struct PlaneSums {
    by_laser: Vec<Shared>,
    plane: PlaneMatrix,
    plane_gradient: PlaneVector,
}

impl PlaneSums {
    pub(super) fn new(lasers: usize) -> Self {
        let by_laser = vec![Shared::default(); lasers];
        Self { by_laser, plane: PlaneMatrix::zeros(), plane_gradient: PlaneVector::zeros() }
    }

    /// Adds one residual.
    pub(super) fn add(&mut self, laser: usize, sight: &Sight, weight: f64) {
        let Some(shared) = self.by_laser.get_mut(laser) else { return };
        let (weighted_laser, weighted_plane) = (sight.by_laser * weight, sight.by_plane * weight);
        shared.laser += weighted_laser * sight.by_laser.transpose();
        shared.mixed += weighted_laser * sight.by_plane.transpose();
        shared.plane += weighted_plane * sight.by_plane.transpose();
        shared.laser_gradient += weighted_laser * sight.residual;
        shared.plane_gradient += weighted_plane * sight.residual;
        shared.range_laser += weighted_laser * sight.by_range;
        shared.range_plane += weighted_plane * sight.by_range;
        shared.range_residual += weight * sight.by_range * sight.residual;
        shared.range += weight * sight.by_range * sight.by_range;
    }

    /// For each laser that saw the plane: by how much its ranges are too long there, and the variance of that for
    /// residuals of unit variance.
    pub(super) fn range_errors(&self) -> impl Iterator<Item = (f64, f64)> {
        let seen = self.by_laser.iter().filter(|shared| shared.range > 0.0);
        seen.map(|shared| (shared.range_residual / shared.range, 1.0 / shared.range))
    }

    /// Closes the sums: the ranges of each laser may have an error of their own on this plane, and all ranges on it one
    /// in common; both as variances for residuals of unit variance. `bias` is the common one so far. `damping` keeps a plane
    /// whose points are nearly on a line from turning about it.
    pub(super) fn close(&mut self, (own, common): (f64, f64), bias: f64, damping: f64) {
        for shared in &mut self.by_laser {
            let part = own / (1.0 + own * shared.range);
            shared.laser -= shared.range_laser * shared.range_laser.transpose() * part;
            shared.mixed -= shared.range_laser * shared.range_plane.transpose() * part;
            shared.plane -= shared.range_plane * shared.range_plane.transpose() * part;
            shared.laser_gradient -= shared.range_laser * (shared.range_residual * part);
            shared.plane_gradient -= shared.range_plane * (shared.range_residual * part);
            self.plane += shared.plane;
            self.plane_gradient += shared.plane_gradient;
        }
        for parameter in 0..OF_PLANE {
            self.plane[(parameter, parameter)] += damping;
        }
        self.plane[(OF_PLANE - 1, OF_PLANE - 1)] += 1.0 / common;
        self.plane_gradient[OF_PLANE - 1] += bias / common;
    }

    /// The plane's own step, given the steps of the lasers; None if its points do not span it.
    pub(super) fn plane_step(&self, steps: &[LaserVector]) -> Option<PlaneVector> {
        let moved = self
            .by_laser
            .iter()
            .zip(steps)
            .fold(self.plane_gradient, |gradient, (shared, step)| gradient + shared.mixed.transpose() * step);
        Some(-(self.plane.try_inverse()? * moved))
    }

    /// Variance of the common error of the ranges, for residuals of unit variance, if the lasers are known.
    pub(super) fn bias_variance(&self) -> f64 {
        self.plane.try_inverse().map_or(0.0, |inverse| inverse[(OF_PLANE - 1, OF_PLANE - 1)])
    }
}

/// The equations of the lasers alone.
pub(super) struct LaserEquations {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    is_observed: Vec<bool>,
}

impl LaserEquations {
    /// Eliminates the planes. A laser that is not observed is held where it is, and so is the mean of all alpha: a common
    /// shift of them is a yaw of the sensor, which no plane can show (gauge of cost 3.7).
    pub(super) fn new(planes: &[PlaneSums], is_observed: &[bool], mean_rotation_error: f64) -> Self {
        let size = OF_LASER * is_observed.len();
        let (mut matrix, mut gradient) = (DMatrix::zeros(size, size), DVector::zeros(size));
        for sums in planes {
            let Some(inverse) = sums.plane.try_inverse() else { continue };
            let seen: Vec<usize> = (0..is_observed.len()).filter(|laser| sums.by_laser[*laser].range > 0.0).collect();
            for row in &seen {
                let shared = &sums.by_laser[*row];
                let carried = shared.mixed * inverse;
                let mut own = matrix.fixed_view_mut::<OF_LASER, OF_LASER>(OF_LASER * row, OF_LASER * row);
                own += shared.laser;
                let mut own = gradient.fixed_rows_mut::<OF_LASER>(OF_LASER * row);
                own += shared.laser_gradient - carried * sums.plane_gradient;
                for column in &seen {
                    let mut block = matrix.fixed_view_mut::<OF_LASER, OF_LASER>(OF_LASER * row, OF_LASER * column);
                    block -= carried * sums.by_laser[*column].mixed.transpose();
                }
            }
        }
        let mut equations = Self { matrix, gradient, is_observed: is_observed.to_vec() };
        equations.hold_mean_rotation(mean_rotation_error);
        equations.hold_unobserved();
        equations
    }

    fn hold_mean_rotation(&mut self, error: f64) {
        let observed: Vec<usize> = (0..self.is_observed.len()).filter(|laser| self.is_observed[*laser]).collect();
        let weight = self.matrix.diagonal().max() / observed.len().max(1) as f64;
        for row in &observed {
            self.gradient[OF_LASER * row + ROTATION] += weight * error;
            for column in &observed {
                self.matrix[(OF_LASER * row + ROTATION, OF_LASER * column + ROTATION)] +=
                    weight / observed.len() as f64;
            }
        }
    }

    fn hold_unobserved(&mut self) {
        for held in (0..self.is_observed.len()).filter(|laser| !self.is_observed[*laser]) {
            for parameter in OF_LASER * held..OF_LASER * (held + 1) {
                self.matrix.row_mut(parameter).fill(0.0);
                self.matrix.column_mut(parameter).fill(0.0);
                self.matrix[(parameter, parameter)] = 1.0;
                self.gradient[parameter] = 0.0;
            }
        }
    }

    /// Adds that each parameter is known: `weights` of the squares of `off`, by which each laser is off what is known.
    pub(super) fn hold_near(&mut self, weights: &LaserVector, off: impl Iterator<Item = LaserVector>) {
        for (laser, off) in off.enumerate().filter(|(laser, _)| self.is_observed.get(*laser) == Some(&true)) {
            for parameter in 0..OF_LASER {
                let row = OF_LASER * laser + parameter;
                self.matrix[(row, row)] += weights[parameter];
                self.gradient[row] += weights[parameter] * off[parameter];
            }
        }
    }

    /// The step of each laser's parameters, and their covariance for residuals of unit variance; None if the scans leave
    /// more undetermined than the gauge.
    pub(super) fn solve(self) -> Option<(Vec<LaserVector>, Vec<LaserMatrix>)> {
        let factor = self.matrix.cholesky()?;
        let step = -factor.solve(&self.gradient);
        let inverse = factor.inverse();
        let lasers = 0..self.is_observed.len();
        let covariance =
            |laser: usize| inverse.fixed_view::<OF_LASER, OF_LASER>(OF_LASER * laser, OF_LASER * laser).into_owned();
        Some((
            lasers.clone().map(|laser| step.fixed_rows::<OF_LASER>(OF_LASER * laser).into_owned()).collect(),
            lasers.map(covariance).collect(),
        ))
    }
}
