//! All lasers and all planes at once, by least squares (M 3.7).
//!
//! Minimising over the lasers and the planes together has the same minimum as fitting each plane anew in every step.
//! Unlike 3.7 the sum is not divided by the points of its scan: every point tells as much as every other.

use std::vec;
use std::vec::Vec;

use nalgebra::{Matrix3, Vector3};

use super::normal_equations::{LaserEquations, PlaneSums};
use super::{Plane, Return, Target};
use crate::calibration::Laser;
use crate::geometry::{Offsets, jacobian};

/// Rounds at most.
const ROUNDS: usize = 40;
/// A laser with fewer points is held where it is.
const LEAST_POINTS: usize = 100;
/// From here on points do not count, in deviations of the noise (Tukey's biweight, 95 % as efficient as least squares).
const CUT: f64 = 4.685;
/// The median of an absolute normal deviate.
const MEDIAN_DEVIATE: f64 = 0.6745;
/// Steps below this part of a parameter's standard deviation end it.
const SMALL: f64 = 0.02;
/// So do steps below this part of the standard deviation to which a parameter is known before: where surfaces are not quite
/// planes, which points count changes a little for ever.
const SMALL_TO_KNOWN: f64 = 0.05;

/// What is made small.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Residual {
    /// From the point to the plane along the beam, where the noise is: unbiased.
    #[default]
    AlongBeam,
    /// From the point to the plane at right angles (M 3.7). As the noise of a point then depends on the angle at which its
    /// beam meets the plane, the least sum is not at the true parameters, but where beams look more oblique.
    Perpendicular,
}

/// Sine of the angle at which a beam meets its plane: from 12 deg downwards points count less, below 6 deg not at all.
const OBLIQUE: [f64; 2] = [0.1, 0.2];

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
    /// Standard deviation of the residuals, m.
    pub noise: f64,
    /// Rounds that it took.
    pub rounds: usize,
}

/// Finds D_corr, theta and alpha of all lasers. The offsets V_o and H_o stay as they are, and so does the mean of alpha.
///
/// # Errors
/// See [`AdjustmentError`].
pub fn calibrate(
    start: &[Laser],
    offsets: Offsets,
    residual: Residual,
    targets: &[Target],
) -> Result<Adjustment, AdjustmentError> {
    adjust(start, offsets, residual, None, targets)
}

/// As [`calibrate`], where the start is known to these standard deviations: what the targets hardly show stays near it.
///
/// # Errors
/// See [`AdjustmentError`].
pub fn calibrate_near(
    start: &[Laser],
    offsets: Offsets,
    residual: Residual,
    prior: &Deviation,
    targets: &[Target],
) -> Result<Adjustment, AdjustmentError> {
    adjust(start, offsets, residual, Some(prior), targets)
}

fn adjust(
    start: &[Laser],
    offsets: Offsets,
    residual: Residual,
    prior: Option<&Deviation>,
    targets: &[Target],
) -> Result<Adjustment, AdjustmentError> {
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
    let known = prior.map_or(Vector3::zeros(), |prior| Vector3::new(prior.distance, prior.elevation, prior.rotation));
    for round in 1..=ROUNDS {
        let noise = noise(&lasers, offsets, residual, targets, &planes);
        let sums: Vec<PlaneSums> = targets
            .iter()
            .zip(&planes)
            .map(|(target, plane)| sums(&lasers, offsets, residual, target, plane, noise))
            .collect();
        let shift = lasers.iter().zip(start).zip(&is_observed).filter(|(_, is_observed)| **is_observed);
        let shift: f64 = shift.map(|((laser, start), _)| laser.rotation - start.rotation).sum();
        let observed = is_observed.iter().filter(|is_observed| **is_observed).count();
        let mut equations = LaserEquations::new(&sums, &is_observed, shift / observed as f64);
        if prior.is_some() {
            let weights = known.map(|deviation| (noise / deviation).powi(2));
            let off = lasers.iter().zip(start).map(|(laser, start)| {
                let by = [laser.distance - start.distance, laser.elevation - start.elevation];
                Vector3::new(by[0], by[1], laser.rotation - start.rotation)
            });
            equations.hold_near(&weights, off);
        }
        let (steps, variances) = equations.solve().ok_or(AdjustmentError::Undetermined)?;
        for (laser, step) in lasers.iter_mut().zip(&steps) {
            laser.distance += step[0];
            laser.elevation += step[1];
            laser.rotation += step[2];
        }
        for (plane, sums) in planes.iter_mut().zip(&sums) {
            // A plane whose points all graze it or lie far off stays where it is, and moves no laser.
            if let Some(step) = sums.plane_step(&steps) {
                *plane = plane.moved(step.into());
            }
        }
        let deviations: Vec<Vector3<f64>> = variances.iter().map(|variance| variance.map(libm::sqrt) * noise).collect();
        let is_small = |(step, deviation): (&Vector3<f64>, &Vector3<f64>)| {
            (0..3).all(|parameter| {
                step[parameter].abs() < (SMALL * deviation[parameter]).max(SMALL_TO_KNOWN * known[parameter])
            })
        };
        if steps.iter().zip(&deviations).all(is_small) {
            let deviations = deviations.iter().zip(&is_observed).map(|(deviation, is_observed)| {
                let [distance, elevation, rotation] = (*deviation).into();
                is_observed.then_some(Deviation { distance, elevation, rotation })
            });
            return Ok(Adjustment { deviations: deviations.collect(), lasers, noise, rounds: round });
        }
    }
    Err(AdjustmentError::Unsettled)
}

/// Where a return lies to its plane.
struct Sight {
    /// From the plane, m.
    residual: f64,
    /// The residual's derivatives by D_corr, theta and alpha.
    by_laser: Vector3<f64>,
    /// The same by the normal itself.
    by_normal: Vector3<f64>,
    /// The same by the plane's distance.
    by_distance: f64,
    /// Between 0 and 1.
    weight: f64,
}

impl Sight {
    /// None if there is no such laser, or the beam only grazes the plane.
    fn new(lasers: &[Laser], offsets: Offsets, kind: Residual, seen: &Return, plane: &Plane) -> Option<Self> {
        let laser = lasers.get(seen.laser)?;
        let normal = Vector3::from(plane.normal);
        // Its columns are the rows of the Jacobian.
        let derivatives = |distance| Matrix3::from(jacobian(laser, offsets, seen.azimuth, distance));
        let at = derivatives(seen.distance);
        let perpendicular = plane.distance_of(seen.point(lasers, offsets)?);
        let point = Vector3::from(seen.point(lasers, offsets)?);
        match kind {
            Residual::Perpendicular => Some(Self {
                residual: perpendicular,
                by_laser: at * normal,
                by_normal: point,
                by_distance: -1.0,
                weight: 1.0,
            }),
            Residual::AlongBeam => {
                let beam = at.row(0).transpose();
                let incidence = beam.dot(&normal);
                let [least, full] = OBLIQUE;
                if incidence.abs() < least {
                    return None;
                }
                // Where the beam meets the plane: derivatives there do not carry the noise of the distance.
                let residual = perpendicular / incidence;
                Some(Self {
                    residual,
                    by_laser: derivatives(seen.distance - residual) * normal / incidence,
                    by_normal: (point - beam * residual) / incidence,
                    by_distance: -1.0 / incidence,
                    weight: ((incidence.abs() - least) / (full - least)).min(1.0),
                })
            }
        }
    }
}

/// Standard deviation of the residuals, by the median, m.
fn noise(lasers: &[Laser], offsets: Offsets, kind: Residual, targets: &[Target], planes: &[Plane]) -> f64 {
    let residuals = targets.iter().zip(planes).flat_map(|(target, plane)| {
        let sights = target.returns.iter().filter_map(|seen| Sight::new(lasers, offsets, kind, seen, plane));
        sights.map(|sight| sight.residual.abs())
    });
    let mut residuals: Vec<f64> = residuals.collect();
    if residuals.is_empty() {
        return f64::INFINITY;
    }
    let middle = residuals.len() / 2;
    let (_, median, _) = residuals.select_nth_unstable_by(middle, f64::total_cmp);
    (*median / MEDIAN_DEVIATE).max(1e-6)
}

fn sums(lasers: &[Laser], offsets: Offsets, kind: Residual, target: &Target, plane: &Plane, noise: f64) -> PlaneSums {
    let mut sums = PlaneSums::new(lasers.len());
    let [first, second] = plane.directions();
    for seen in &target.returns {
        let Some(sight) = Sight::new(lasers, offsets, kind, seen, plane) else { continue };
        let deviate = sight.residual.abs() / noise;
        if deviate > CUT {
            continue;
        }
        let by_plane = Vector3::new(first.dot(&sight.by_normal), second.dot(&sight.by_normal), sight.by_distance);
        let weight = sight.weight * (1.0 - (deviate / CUT).powi(2)).powi(2);
        sums.add(seen.laser, sight.by_laser, by_plane, sight.residual, weight);
    }
    sums
}
