//! All lasers and all planes at once, by least squares (M 3.7).
//!
//! Minimising over the lasers and the planes together has the same minimum as fitting each plane anew in every step.
//! Unlike 3.7 the sum is not divided by the points of its scan: every point tells as much as every other.

use std::vec;
use std::vec::Vec;

use nalgebra::{Matrix3, Vector3};

use super::normal_equations::{LaserEquations, PlaneSums};
use super::{Plane, Target};
use crate::calibration::Laser;
use crate::geometry::{Offsets, jacobian};

/// Rounds at most.
const ROUNDS: usize = 40;
/// A laser with fewer points is held where it is.
const LEAST_POINTS: usize = 100;
/// Points count less from here on, and not at all from here on, in deviations of the noise (Huber; truncated).
const LESS: f64 = 1.5;
const CUT: f64 = 4.0;
/// The median of an absolute normal deviate.
const MEDIAN_DEVIATE: f64 = 0.6745;
/// Steps below these end it: m, rad, rad.
const SMALL: [f64; 3] = [1e-6, 1e-8, 1e-8];

/// Why there is no calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AdjustmentError {
    /// There is nothing to calibrate with.
    #[error("no laser has the {LEAST_POINTS} points on the targets that it needs")]
    NoPoints,
    /// The scans do not determine the parameters.
    #[error("the scans do not determine the lasers: scan the plane from more distances and at more tilts")]
    Undetermined,
    /// It does not settle.
    #[error("it does not settle within {ROUNDS} rounds: the start is too far off, or the targets are no planes")]
    Unsettled,
}

/// Standard deviations of one laser's parameters, against the gauge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Of D_corr, m.
    pub distance: f64,
    /// Of theta, rad.
    pub elevation: f64,
    /// Of alpha, rad; the mean of all alpha is held.
    pub rotation: f64,
}

/// A calibration found.
#[derive(Clone, Debug)]
pub struct Adjustment {
    /// The lasers; those that were not observed are as at the start.
    pub lasers: Vec<Laser>,
    /// How well each is known; None for a laser that was not observed.
    pub deviations: Vec<Option<Deviation>>,
    /// Standard deviation of a point from its plane, m.
    pub noise: f64,
    /// Rounds that it took.
    pub rounds: usize,
}

/// Finds D_corr, theta and alpha of all lasers. The offsets V_o and H_o stay as they are, and so does the mean of alpha.
///
/// # Errors
/// See [`AdjustmentError`].
pub fn calibrate(start: &[Laser], offsets: Offsets, targets: &[Target]) -> Result<Adjustment, AdjustmentError> {
    let mut points = vec![0_usize; start.len()];
    for seen in targets.iter().flat_map(|target| &target.returns) {
        if let Some(count) = points.get_mut(seen.laser) {
            *count += 1;
        }
    }
    let is_observed: Vec<bool> = points.iter().map(|count| *count >= LEAST_POINTS).collect();
    if !is_observed.contains(&true) {
        return Err(AdjustmentError::NoPoints);
    }
    let mut lasers = start.to_vec();
    let mut planes: Vec<Plane> = targets.iter().map(|target| target.plane).collect();
    for round in 1..=ROUNDS {
        let noise = noise(&lasers, offsets, targets, &planes);
        let sums: Vec<PlaneSums> =
            targets.iter().zip(&planes).map(|(target, plane)| sums(&lasers, offsets, target, plane, noise)).collect();
        let shift = lasers.iter().zip(start).zip(&is_observed).filter(|(_, is_observed)| **is_observed);
        let shift: f64 = shift.map(|((laser, start), _)| laser.rotation - start.rotation).sum();
        let observed = is_observed.iter().filter(|is_observed| **is_observed).count();
        let equations = LaserEquations::new(&sums, &is_observed, shift / observed as f64);
        let (steps, variances) = equations.solve().ok_or(AdjustmentError::Undetermined)?;
        for (laser, step) in lasers.iter_mut().zip(&steps) {
            laser.distance += step[0];
            laser.elevation += step[1];
            laser.rotation += step[2];
        }
        for (plane, sums) in planes.iter_mut().zip(&sums) {
            let step = sums.plane_step(&steps).ok_or(AdjustmentError::Undetermined)?;
            *plane = plane.moved(step.into());
        }
        let is_small = |step: &Vector3<f64>| step.iter().zip(SMALL).all(|(value, small)| value.abs() < small);
        if steps.iter().all(is_small) {
            let deviations = variances.iter().zip(&is_observed).map(|(variance, is_observed)| {
                let [distance, elevation, rotation] = (variance.map(libm::sqrt) * noise).into();
                is_observed.then_some(Deviation { distance, elevation, rotation })
            });
            return Ok(Adjustment { deviations: deviations.collect(), lasers, noise, rounds: round });
        }
    }
    Err(AdjustmentError::Unsettled)
}

/// Standard deviation of the points from their planes, by the median, m.
fn noise(lasers: &[Laser], offsets: Offsets, targets: &[Target], planes: &[Plane]) -> f64 {
    let residuals = targets.iter().zip(planes).flat_map(|(target, plane)| {
        let points = target.returns.iter().filter_map(|seen| seen.point(lasers, offsets));
        points.map(|point| plane.distance_of(point).abs())
    });
    let mut residuals: Vec<f64> = residuals.collect();
    let middle = residuals.len() / 2;
    let (_, median, _) = residuals.select_nth_unstable_by(middle, f64::total_cmp);
    (*median / MEDIAN_DEVIATE).max(1e-6)
}

fn sums(lasers: &[Laser], offsets: Offsets, target: &Target, plane: &Plane, noise: f64) -> PlaneSums {
    let mut sums = PlaneSums::new(lasers.len());
    let normal = Vector3::from(plane.normal);
    let [first, second] = plane.directions();
    for seen in &target.returns {
        let Some(laser) = lasers.get(seen.laser) else { continue };
        let Some(point) = seen.point(lasers, offsets) else { continue };
        let residual = plane.distance_of(point);
        let deviate = residual.abs() / noise;
        if deviate > CUT {
            continue;
        }
        let weight = (LESS / deviate).min(1.0);
        // Of arrays of columns, nalgebra makes the transpose of what the array of rows means.
        let derivatives = Matrix3::from(jacobian(laser, offsets, seen.azimuth, seen.distance));
        let point = Vector3::from(point);
        let by_plane = Vector3::new(first.dot(&point), second.dot(&point), -1.0);
        sums.add(seen.laser, derivatives * normal, by_plane, residual, weight);
    }
    sums
}
