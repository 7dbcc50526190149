//! The normal equations of all lasers and planes, with the planes eliminated.
//!
//! A residual couples one laser and one plane only, so each plane can be eliminated by a matrix of three by three; what
//! remains has three unknowns a laser.

use std::vec;
use std::vec::Vec;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

/// D_corr in m, theta and alpha in rad of each laser, or their variances.
type PerLaser = Vec<Vector3<f64>>;

/// What one plane and one laser share.
#[derive(Clone, Copy, Default)]
struct Shared {
    laser: Matrix3<f64>,
    mixed: Matrix3<f64>,
    laser_gradient: Vector3<f64>,
}

/// The sums over the points of one plane.
pub(super) struct PlaneSums {
    by_laser: Vec<Shared>,
    plane: Matrix3<f64>,
    plane_gradient: Vector3<f64>,
}

impl PlaneSums {
    pub(super) fn new(lasers: usize) -> Self {
        let by_laser = vec![Shared::default(); lasers];
        Self { by_laser, plane: Matrix3::zeros(), plane_gradient: Vector3::zeros() }
    }

    /// Adds one residual with its derivatives by the laser's and the plane's parameters.
    pub(super) fn add(
        &mut self,
        laser: usize,
        by_laser: Vector3<f64>,
        by_plane: Vector3<f64>,
        residual: f64,
        weight: f64,
    ) {
        let Some(shared) = self.by_laser.get_mut(laser) else { return };
        let (weighted_laser, weighted_plane) = (by_laser * weight, by_plane * weight);
        shared.laser += weighted_laser * by_laser.transpose();
        shared.mixed += weighted_laser * by_plane.transpose();
        shared.laser_gradient += weighted_laser * residual;
        self.plane += weighted_plane * by_plane.transpose();
        self.plane_gradient += weighted_plane * residual;
    }

    /// The plane's own step, given the steps of the lasers; None if its points do not span it.
    pub(super) fn plane_step(&self, steps: &[Vector3<f64>]) -> Option<Vector3<f64>> {
        let moved = self
            .by_laser
            .iter()
            .zip(steps)
            .fold(self.plane_gradient, |gradient, (shared, step)| gradient + shared.mixed.transpose() * step);
        Some(-(self.plane.try_inverse()? * moved))
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
        let size = 3 * is_observed.len();
        let (mut matrix, mut gradient) = (DMatrix::zeros(size, size), DVector::zeros(size));
        for sums in planes {
            let Some(inverse) = sums.plane.try_inverse() else { continue };
            let seen: Vec<usize> =
                (0..is_observed.len()).filter(|laser| sums.by_laser[*laser].laser.trace() > 0.0).collect();
            for row in &seen {
                let shared = &sums.by_laser[*row];
                let carried = shared.mixed * inverse;
                let mut own = matrix.fixed_view_mut::<3, 3>(3 * row, 3 * row);
                own += shared.laser;
                let mut own = gradient.fixed_rows_mut::<3>(3 * row);
                own += shared.laser_gradient - carried * sums.plane_gradient;
                for column in &seen {
                    let mut block = matrix.fixed_view_mut::<3, 3>(3 * row, 3 * column);
                    block -= carried * sums.by_laser[*column].mixed.transpose();
                }
            }
        }
        let observed: Vec<usize> = (0..is_observed.len()).filter(|laser| is_observed[*laser]).collect();
        let weight = matrix.diagonal().max() / observed.len().max(1) as f64;
        for row in &observed {
            gradient[3 * row + 2] += weight * mean_rotation_error;
            for column in &observed {
                matrix[(3 * row + 2, 3 * column + 2)] += weight / observed.len() as f64;
            }
        }
        for held in (0..is_observed.len()).filter(|laser| !is_observed[*laser]) {
            for parameter in 3 * held..3 * held + 3 {
                matrix.row_mut(parameter).fill(0.0);
                matrix.column_mut(parameter).fill(0.0);
                matrix[(parameter, parameter)] = 1.0;
                gradient[parameter] = 0.0;
            }
        }
        Self { matrix, gradient, is_observed: is_observed.to_vec() }
    }

    /// Adds that each parameter is known: `weights` of the squares of `off`, by which each laser is off what is known.
    pub(super) fn hold_near(&mut self, weights: &Vector3<f64>, off: impl Iterator<Item = Vector3<f64>>) {
        for (laser, off) in off.enumerate().filter(|(laser, _)| self.is_observed.get(*laser) == Some(&true)) {
            for parameter in 0..3 {
                let row = 3 * laser + parameter;
                self.matrix[(row, row)] += weights[parameter];
                self.gradient[row] += weights[parameter] * off[parameter];
            }
        }
    }

    /// The step of each laser's D_corr, theta and alpha, and the variance of each for residuals of unit variance; None if
    /// the scans leave more undetermined than the gauge.
    pub(super) fn solve(self) -> Option<(PerLaser, PerLaser)> {
        let factor = self.matrix.cholesky()?;
        let step = -factor.solve(&self.gradient);
        let variance = factor.inverse().diagonal();
        let of_laser = |values: &DVector<f64>, laser: usize| values.fixed_rows::<3>(3 * laser).into_owned();
        let lasers = 0..self.is_observed.len();
        Some((
            lasers.clone().map(|laser| of_laser(&step, laser)).collect(),
            lasers.map(|laser| of_laser(&variance, laser)).collect(),
        ))
    }
}
