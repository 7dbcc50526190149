//! All lasers and all planes at once: robust Gauss-Newton on the distances to the planes, with analytic derivatives.
//!
//! A common shift of all alpha is a yaw of the sensor, which no plane shows: the mean of alpha keeps its start value.

use std::vec::Vec;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::plane::{Plane, fit};
use crate::calibration::Laser;
use crate::geometry::{Offsets, jacobian, point};

const PARAMETERS: usize = 3;
const MAX_ITERATIONS: usize = 30;
/// Residuals beyond so many standard deviations count less (Huber).
const HUBER: f64 = 2.5;
/// Weight that holds the mean of alpha, 1/rad^2, and that keeps lasers that saw nothing where they are.
const GAUGE: f64 = 1e12;
const UNSEEN: f64 = 1e-6;

/// One return from a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Return {
    /// Number of the laser.
    pub laser: usize,
    /// Angle of the head, rad.
    pub azimuth: f64,
    /// Measured distance, m.
    pub distance: f64,
}

/// Why there is no solution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SolveError {
    /// A scan holds fewer than three returns.
    #[error("scan {scan} holds too few returns for a plane")]
    Plane {
        /// Number of the scan, from 0.
        scan: usize,
    },
    /// A return states a laser that the calibration does not have.
    #[error("scan {scan} has a return of laser {laser}, which the calibration does not have")]
    Laser {
        /// Number of the scan, from 0.
        scan: usize,
        /// Number of the laser.
        laser: usize,
    },
    /// The scans do not determine the parameters.
    #[error("the scans do not determine the parameters")]
    NotObservable,
}

/// Standard deviations of a laser's parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uncertainty {
    /// Of D_corr, m.
    pub distance: f64,
    /// Of theta, rad.
    pub elevation: f64,
    /// Of alpha, rad.
    pub rotation: f64,
    /// Returns that it had.
    pub returns: usize,
}

/// The solution.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// With D_corr, theta and alpha found; the rest as it was.
    pub lasers: Vec<Laser>,
    /// One a laser.
    pub uncertainty: Vec<Uncertainty>,
    /// Sum of squared distances to the fitted planes before and after, m^2.
    pub sums_of_squares: [f64; 2],
    /// Iterations.
    pub iterations: usize,
    /// Standard deviation of the distances to the planes, m.
    pub noise: f64,
}

/// Finds D_corr, theta and alpha of all lasers from scans of planes.
///
/// # Errors
/// See [`SolveError`].
pub fn solve(start: &[Laser], offsets: Offsets, scans: &[Vec<Return>]) -> Result<Outcome, SolveError> {
    let mut lasers = start.to_vec();
    let size = PARAMETERS * lasers.len();
    let mut counts = std::vec![0; lasers.len()];
    for (scan, returns) in scans.iter().enumerate() {
        for Return { laser, .. } in returns {
            *counts.get_mut(*laser).ok_or(SolveError::Laser { scan, laser: *laser })? += 1;
        }
    }
    let before = sum_of_squares(&lasers, offsets, scans)?;
    let mut noise = noise_of(&lasers, offsets, scans)?;
    let mut iterations = 0;
    let mut information = DMatrix::zeros(size, size);
    while iterations < MAX_ITERATIONS {
        iterations += 1;
        let (matrix, vector) = equations(&lasers, offsets, scans, noise, size)?;
        information = matrix;
        let shift: f64 = lasers.iter().zip(start).map(|(laser, start)| laser.rotation - start.rotation).sum();
        let mut vector = vector;
        for laser in 0..lasers.len() {
            vector[PARAMETERS * laser + 2] -= GAUGE * shift / lasers.len() as f64;
            for other in 0..lasers.len() {
                information[(PARAMETERS * laser + 2, PARAMETERS * other + 2)] += GAUGE / lasers.len() as f64;
            }
            for parameter in 0..PARAMETERS {
                information[(PARAMETERS * laser + parameter, PARAMETERS * laser + parameter)] += UNSEEN;
            }
        }
        let step = information.clone().cholesky().ok_or(SolveError::NotObservable)?.solve(&vector);
        for (laser, step) in lasers.iter_mut().zip(step.as_slice().as_chunks::<PARAMETERS>().0) {
            laser.distance += step[0];
            laser.elevation += step[1];
            laser.rotation += step[2];
        }
        noise = noise_of(&lasers, offsets, scans)?;
        if step.amax() < 1e-8 {
            break;
        }
    }
    let covariance = information.cholesky().ok_or(SolveError::NotObservable)?.inverse();
    let deviation = |index: usize| noise * libm::sqrt(covariance[(index, index)].max(0.0));
    let uncertainty = counts.iter().enumerate().map(|(laser, returns)| Uncertainty {
        distance: deviation(PARAMETERS * laser),
        elevation: deviation(PARAMETERS * laser + 1),
        rotation: deviation(PARAMETERS * laser + 2),
        returns: *returns,
    });
    let uncertainty = uncertainty.collect();
    let after = sum_of_squares(&lasers, offsets, scans)?;
    Ok(Outcome { lasers, uncertainty, sums_of_squares: [before, after], iterations, noise })
}

/// The normal equations of the lasers, the planes eliminated scan by scan (Schur complement).
fn equations(
    lasers: &[Laser],
    offsets: Offsets,
    scans: &[Vec<Return>],
    noise: f64,
    size: usize,
) -> Result<(DMatrix<f64>, DVector<f64>), SolveError> {
    let mut matrix = DMatrix::zeros(size, size);
    let mut vector = DVector::zeros(size);
    for (scan, returns) in scans.iter().enumerate() {
        let plane = plane_of(lasers, offsets, scan, returns)?;
        let [across, upwards] = tangents(plane.normal);
        let mut of_plane = Matrix3::<f64>::zeros();
        let mut of_plane_vector = Vector3::<f64>::zeros();
        let mut mixed = DMatrix::<f64>::zeros(size, PARAMETERS);
        for Return { laser, azimuth, distance } in returns {
            let of = &lasers[*laser];
            let at = Vector3::from(point(of, offsets, *azimuth, *distance));
            let residual = plane.residual(at);
            let size_of_residual = residual.abs() / noise.max(f64::MIN_POSITIVE);
            let weight = if size_of_residual <= HUBER { 1.0 } else { HUBER / size_of_residual };
            let derivatives = Matrix3::from(jacobian(of, offsets, *azimuth, *distance)).transpose();
            let by_laser = derivatives.transpose() * plane.normal;
            let by_plane = Vector3::new(across.dot(&at), upwards.dot(&at), -1.0);
            let first = PARAMETERS * laser;
            let mut block = matrix.fixed_view_mut::<3, 3>(first, first);
            block += weight * by_laser * by_laser.transpose();
            let mut rows = mixed.fixed_view_mut::<3, 3>(first, 0);
            rows += weight * by_laser * by_plane.transpose();
            let mut part = vector.fixed_rows_mut::<3>(first);
            part -= weight * residual * by_laser;
            of_plane += weight * by_plane * by_plane.transpose();
            of_plane_vector -= weight * residual * by_plane;
        }
        let inverse = of_plane.try_inverse().ok_or(SolveError::NotObservable)?;
        let eliminated = &mixed * inverse;
        vector -= &eliminated * of_plane_vector;
        matrix -= eliminated * mixed.transpose();
    }
    Ok((matrix, vector))
}

fn plane_of(lasers: &[Laser], offsets: Offsets, scan: usize, returns: &[Return]) -> Result<Plane, SolveError> {
    let points = returns.iter().map(|seen| point(&lasers[seen.laser], offsets, seen.azimuth, seen.distance));
    fit(points).ok_or(SolveError::Plane { scan })
}

/// Two unit vectors that span a plane.
fn tangents(normal: Vector3<f64>) -> [Vector3<f64>; 2] {
    let other = if normal.z.abs() < 0.9 { Vector3::z() } else { Vector3::x() };
    let across = normal.cross(&other).normalize();
    [across, normal.cross(&across)]
}

fn residuals(lasers: &[Laser], offsets: Offsets, scans: &[Vec<Return>]) -> Result<Vec<f64>, SolveError> {
    let mut all = Vec::new();
    for (scan, returns) in scans.iter().enumerate() {
        let plane = plane_of(lasers, offsets, scan, returns)?;
        let at = |seen: &Return| point(&lasers[seen.laser], offsets, seen.azimuth, seen.distance);
        all.extend(returns.iter().map(|seen| plane.residual(Vector3::from(at(seen)))));
    }
    Ok(all)
}

fn sum_of_squares(lasers: &[Laser], offsets: Offsets, scans: &[Vec<Return>]) -> Result<f64, SolveError> {
    Ok(residuals(lasers, offsets, scans)?.iter().map(|residual| residual * residual).sum())
}

/// Standard deviation from the median of the absolute residuals, m.
fn noise_of(lasers: &[Laser], offsets: Offsets, scans: &[Vec<Return>]) -> Result<f64, SolveError> {
    let mut sizes: Vec<f64> = residuals(lasers, offsets, scans)?.iter().map(|residual| residual.abs()).collect();
    let middle = sizes.len() / 2;
    if sizes.is_empty() {
        return Err(SolveError::NotObservable);
    }
    let (_, median, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
    Ok(1.4826 * *median)
}
