//! All lasers and all planes at once, by least squares (M 3.7).
//!
//! Minimising over the lasers and the planes together has the same minimum as fitting each plane anew in every step.
//! Unlike 3.7 the sum is not divided by the points of its scan: every point tells as much as every other.
//!
//! Walls do not show everything: upright ones hardly say where a beam points up or down. So the factory's values count as
//! measurements of their own, and what the walls do not show stays at them. How far they may be off is learnt from the
//! lasers together, beginning with what factories are believed to reach. Nor is the noise of the points all that is wrong with ranges: the ranges of a scan may be too long together, and
//! those of a laser on a wall by themselves. Both are unknowns of their own, and the residuals tell how great they are.

use std::vec;
use std::vec::Vec;

use super::normal_equations::{LaserEquations, LaserMatrix, PlaneSums};
use super::sight::{LaserVector, OF_LASER, Sight};
use super::{Adjustment, Deviation, Plane, Target};
use crate::calibration::Laser;
use crate::geometry::Offsets;

/// Rounds at most.
const ROUNDS: usize = 60;
/// Rounds before the residuals tell how great the errors of the ranges are: at first they show those of the start.
const FIRST_ROUNDS: usize = 4;
/// From here on what was learnt stays: on surfaces that are not quite planes it would change a little for ever.
const LEARNT_ROUNDS: usize = 30;
/// A laser with fewer points is held where it is.
const LEAST_POINTS: usize = 100;
/// From here on points do not count, in deviations of the noise (Tukey's biweight, 95 % as efficient as least squares).
const CUT: f64 = 4.685;
/// The median of an absolute normal deviate.
const MEDIAN_DEVIATE: f64 = 0.6745;
/// Steps below this part of a parameter's standard deviation end it.
const SMALL: f64 = 0.02;
/// So do steps below this part of the standard deviation to which a parameter is known before: where surfaces are not quite
/// planes, which points count changes a little for ever. The second holds while that deviation itself is learnt.
const SMALL_TO_KNOWN: f64 = 0.05;
const SMALL_TO_BELIEVED: f64 = 0.002;
/// To which part of the factory's the deviation of a point must fall at 10 m.
const GAINED: f64 = 0.9;
/// Errors of ranges to begin with, standard deviations, m: of all in a scan (the accuracy that makers state), and of a
/// laser's own on a wall.
const COMMON_ERROR: f64 = 0.01;
const OWN_ERROR: f64 = 0.005;
/// A plane is found to about this, rad and m, before its points say more.
const PLANE_STEP: f64 = 0.3;
/// Below this they are none, m.
const NO_ERROR: f64 = 1e-5;

/// Believed deviations of the start count like those of so many values; what is learnt stays between these parts of them.
const FEW: f64 = 0.5;
const LEAST_OFF: f64 = 0.02;
const MOST_OFF: f64 = 4.0;

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

/// Why there is no calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AdjustmentError {
    /// There is nothing to calibrate with.
    #[error("no laser has the {LEAST_POINTS} points on the targets that it needs")]
    NoPoints,
    /// The scans do not determine the parameters.
    #[error("the scans do not determine the lasers: scan the plane from more distances and at more tilts")]
    Undetermined,
    /// Points would be hardly better known than with the factory's values.
    #[error(
        "the scans say hardly more than the factory's values ({percent} % of their deviation is left): scan the plane \
         from more distances and at more tilts"
    )]
    NothingGained {
        /// Deviation of a point at 10 m, of that with the factory's values.
        percent: u32,
    },
    /// It does not settle.
    #[error("it does not settle within {ROUNDS} rounds: the start is too far off, or the targets are no planes")]
    Unsettled,
}

/// Finds D_corr, theta and alpha of all lasers, and V_o and H_o. What the start is off is learnt, from
/// [`Deviation::FACTORY`] on; the mean of alpha stays as it is.
///
/// # Errors
/// See [`AdjustmentError`].
pub fn calibrate(
    start: &[Laser],
    offsets: Offsets,
    residual: Residual,
    targets: &[Target],
) -> Result<Adjustment, AdjustmentError> {
    let found = adjust(start, offsets, residual, (&Deviation::FACTORY, true), targets)?;
    let part = found.part_left(offsets);
    if part > GAINED {
        return Err(AdjustmentError::NothingGained { percent: (100.0 * part).round() as u32 });
    }
    Ok(found)
}

/// As [`calibrate`], where the start is known to these standard deviations, and however little is gained.
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
    adjust(start, offsets, residual, (prior, false), targets)
}

/// With what is known of the start, and whether to learn more of that.
fn adjust(
    start: &[Laser],
    offsets: Offsets,
    residual: Residual,
    (prior, is_learning): (&Deviation, bool),
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
    let problem = Problem { start, offsets, residual, prior: prior.vector(), is_learning, targets, is_observed };
    let mut state = State {
        lasers: start.to_vec(),
        planes: targets.iter().map(|target| (target.plane, 0.0)).collect(),
        own: OWN_ERROR,
        common: COMMON_ERROR,
        known: prior.vector(),
    };
    for round in 1..=ROUNDS {
        let is_learning = (FIRST_ROUNDS + 1..=LEARNT_ROUNDS).contains(&round);
        let outcome = problem.step(&mut state, is_learning)?;
        if outcome.is_settled && round > FIRST_ROUNDS {
            return Ok(problem.found(state, outcome, round));
        }
    }
    Err(AdjustmentError::Unsettled)
}

/// What does not change from round to round.
struct Problem<'a> {
    start: &'a [Laser],
    offsets: Offsets,
    residual: Residual,
    /// Standard deviations of the start, as they are believed to be.
    prior: LaserVector,
    is_learning: bool,
    targets: &'a [Target],
    is_observed: Vec<bool>,
}

/// What is sought.
struct State {
    lasers: Vec<Laser>,
    /// With the common error of the ranges, m.
    planes: Vec<(Plane, f64)>,
    /// Standard deviations of the errors of ranges, m.
    own: f64,
    common: f64,
    /// Standard deviations of the start, as far as they are learnt.
    known: LaserVector,
}

/// What a round found.
struct Outcome {
    noise: f64,
    covariances: Vec<LaserMatrix>,
    is_settled: bool,
}

impl Problem<'_> {
    /// One round of Gauss and Newton.
    fn step(&self, state: &mut State, is_learning: bool) -> Result<Outcome, AdjustmentError> {
        let noise = self.noise(state);
        let mut sums: Vec<PlaneSums> = self
            .targets
            .iter()
            .zip(&state.planes)
            .map(|(target, plane)| self.sums(&state.lasers, target, (&plane.0, plane.1), noise))
            .collect();
        if is_learning {
            state.own = self.own_error(&sums, noise);
        }
        let part = |deviation: f64| (deviation / noise).powi(2);
        for (sums, (_, bias)) in sums.iter_mut().zip(&state.planes) {
            sums.close((part(state.own), part(state.common)), *bias, (noise / PLANE_STEP).powi(2));
        }
        if is_learning {
            state.common = common_error(&sums, &state.planes, noise);
        }
        let (steps, covariances) = self.equations(state, &sums, noise).solve().ok_or(AdjustmentError::Undetermined)?;
        for (laser, step) in state.lasers.iter_mut().zip(&steps) {
            laser.distance += step[0];
            laser.elevation += step[1];
            laser.rotation += step[2];
            laser.vertical_offset += step[3];
            laser.horizontal_offset += step[4];
        }
        for ((plane, bias), sums) in state.planes.iter_mut().zip(&sums) {
            // A plane whose points all graze it or lie far off stays where it is, and moves no laser.
            if let Some(step) = sums.plane_step(&steps) {
                *plane = plane.moved([step[0], step[1], step[2]]);
                *bias += step[3];
            }
        }
        let covariances: Vec<LaserMatrix> =
            covariances.into_iter().map(|covariance| covariance * noise.powi(2)).collect();
        if is_learning && self.is_learning {
            state.known = self.learnt(state, &covariances);
        }
        let part = if self.is_learning { SMALL_TO_BELIEVED } else { SMALL_TO_KNOWN };
        let is_small = |(step, covariance): (&LaserVector, &LaserMatrix)| {
            (0..OF_LASER).all(|parameter| {
                let deviation = covariance[(parameter, parameter)].sqrt();
                step[parameter].abs() < (SMALL * deviation).max(part * self.prior[parameter])
            })
        };
        let is_settled = steps.iter().zip(&covariances).all(is_small);
        Ok(Outcome { noise, covariances, is_settled })
    }

    fn equations(&self, state: &State, sums: &[PlaneSums], noise: f64) -> LaserEquations {
        let pairs = || state.lasers.iter().zip(self.start);
        let shift = pairs().zip(&self.is_observed).filter(|(_, is_observed)| **is_observed);
        let shift: f64 = shift.map(|((laser, start), _)| laser.rotation - start.rotation).sum();
        let observed = self.is_observed.iter().filter(|is_observed| **is_observed).count();
        let mut equations = LaserEquations::new(sums, &self.is_observed, shift / observed as f64);
        let weights = state.known.map(|deviation| (noise / deviation).powi(2));
        equations.hold_near(&weights, pairs().map(off));
        equations
    }

    /// How far the start is off: the sum of the squares found, by the number of values that the scans determine
    /// (MacKay's evidence approximation). Little is learnt where the scans determine less than a few values.
    fn learnt(&self, state: &State, covariances: &[LaserMatrix]) -> LaserVector {
        let (mut squares, mut determined) = (LaserVector::zeros(), LaserVector::zeros());
        let variances = state.known.map(|deviation| deviation * deviation);
        let all = state.lasers.iter().zip(self.start).zip(covariances).zip(&self.is_observed);
        for ((pair, covariance), _) in all.filter(|(_, is_observed)| **is_observed) {
            squares += off(pair).map(|off| off * off);
            determined += covariance.diagonal().zip_map(&variances, |left, before| (1.0 - left / before).max(0.0));
        }
        LaserVector::from_fn(|parameter, _| {
            let believed = self.prior[parameter];
            let before = FEW * believed * believed;
            let learnt = ((squares[parameter] + before) / (determined[parameter] + FEW)).sqrt();
            learnt.clamp(LEAST_OFF * believed, MOST_OFF * believed)
        })
    }

    /// Standard deviation of the residuals, by the median, m.
    fn noise(&self, state: &State) -> f64 {
        let residuals = self.targets.iter().zip(&state.planes).flat_map(|(target, (plane, bias))| {
            let sight = |seen| Sight::new(&state.lasers, self.offsets, self.residual, seen, (plane, *bias));
            target.returns.iter().filter_map(sight).map(|sight| sight.residual.abs())
        });
        let mut residuals: Vec<f64> = residuals.collect();
        if residuals.is_empty() {
            return f64::INFINITY;
        }
        let middle = residuals.len() / 2;
        let (_, median, _) = residuals.select_nth_unstable_by(middle, f64::total_cmp);
        (*median / MEDIAN_DEVIATE).max(1e-6)
    }

    fn sums(&self, lasers: &[Laser], target: &Target, plane: (&Plane, f64), noise: f64) -> PlaneSums {
        let mut sums = PlaneSums::new(lasers.len());
        for seen in target.returns.iter().filter(|seen| self.is_observed.get(seen.laser) == Some(&true)) {
            let Some(sight) = Sight::new(lasers, self.offsets, self.residual, seen, plane) else { continue };
            let deviate = sight.residual.abs() / noise;
            if deviate < CUT {
                let weight = sight.weight * (1.0 - (deviate / CUT).powi(2)).powi(2);
                sums.add(seen.laser, &sight, weight);
            }
        }
        sums
    }

    /// Standard deviation of the error that the ranges of one laser on one target have together, m, by moments.
    fn own_error(&self, sums: &[PlaneSums], noise: f64) -> f64 {
        let (mut squares, mut count) = (0.0, 0);
        for (mean, variance) in sums.iter().flat_map(PlaneSums::range_errors) {
            squares += mean * mean - variance * noise * noise;
            count += 1;
        }
        let lasers = self.is_observed.iter().filter(|is_observed| **is_observed).count();
        let free = count as f64 - (3 * (lasers + sums.len())) as f64;
        (squares / free.max(0.25 * f64::from(count)).max(1.0)).max(0.0).sqrt()
    }

    fn found(&self, state: State, outcome: Outcome, rounds: usize) -> Adjustment {
        let seen = |covariances: Vec<LaserMatrix>| {
            covariances
                .into_iter()
                .zip(&self.is_observed)
                .map(|(covariance, is_observed)| is_observed.then_some(covariance))
        };
        let covariances: Vec<Option<LaserMatrix>> = seen(outcome.covariances).collect();
        let deviation = |covariance: &Option<LaserMatrix>| {
            covariance.map(|covariance| Deviation::of_vector(covariance.diagonal().map(f64::sqrt)))
        };
        Adjustment {
            deviations: covariances.iter().map(deviation).collect(),
            lasers: state.lasers,
            noise: outcome.noise,
            range_error: state.own,
            common_range_errors: state.planes.iter().map(|(_, bias)| *bias).collect(),
            rounds,
            start_deviation: Deviation::of_vector(state.known),
            covariances,
        }
    }
}

/// How far a laser is off the start.
fn off((laser, start): (&Laser, &Laser)) -> LaserVector {
    LaserVector::new(
        laser.distance - start.distance,
        laser.elevation - start.elevation,
        laser.rotation - start.rotation,
        laser.vertical_offset - start.vertical_offset,
        laser.horizontal_offset - start.horizontal_offset,
    )
}

/// Standard deviation of the error that all ranges of a scan have together, m: the mean square of what is found and of what
/// stays open (a step of expectation maximisation).
fn common_error(sums: &[PlaneSums], planes: &[(Plane, f64)], noise: f64) -> f64 {
    let squares = sums.iter().zip(planes).map(|(sums, (_, bias))| bias * bias + sums.bias_variance() * noise * noise);
    (squares.sum::<f64>() / planes.len().max(1) as f64).sqrt().max(NO_ERROR)
}
