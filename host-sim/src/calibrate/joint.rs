//! All parameters at once, by nonlinear least squares over windows.

use nalgebra::{Matrix3, SMatrix};
use thiserror::Error;

use super::least_squares::{Linearised, minimise};
use super::model::{PARAMETERS, VehicleModel};
use super::noise::{Disturbances, NoiseModel};
use super::whitening::Whitening;
use super::window::Window;

/// Which parameters the fit may change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Free {
    /// Whether there is an offset for each sense of travel; otherwise both are one.
    pub offsets_differ: bool,
    /// The wheelbase.
    pub wheelbase: bool,
    /// The steering ratio.
    pub steering_ratio: bool,
}

impl Free {
    /// For each free unknown the parameters that it moves.
    fn unknowns(self) -> Vec<Vec<usize>> {
        let mut unknowns = if self.offsets_differ { vec![vec![0], vec![1]] } else { vec![vec![0, 1]] };
        unknowns.push(vec![2]);
        unknowns.extend(self.wheelbase.then(|| vec![3]));
        unknowns.extend(self.steering_ratio.then(|| vec![4]));
        unknowns.extend([vec![5], vec![6], vec![7]]);
        unknowns
    }
}

/// Why a fit gives nothing.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum FitError {
    /// There are fewer windows than unknowns need.
    #[error("there are too few windows for so many unknowns")]
    TooFewWindows,
    /// The solver does not converge.
    #[error("the nonlinear fit does not converge")]
    NoConvergence,
    /// Unknowns cannot be told apart.
    #[error("the windows cannot tell the unknowns apart")]
    Singular,
}

/// What a fit found.
#[derive(Clone, Debug, PartialEq)]
pub struct JointFit {
    /// The parameters.
    pub model: VehicleModel,
    /// Their standard deviations, zero for those that were held.
    pub deviations: [f64; PARAMETERS],
    /// Noise that the residuals imply.
    pub noise: NoiseModel,
    /// Weight of each window, from one down to zero for a window that does not agree with the others.
    pub weights: Vec<f64>,
    /// Residuals by their deviations: root of the mean square over windows of full weight.
    pub normalised_rms: f64,
}

/// Rounds of fit, noise and weights.
const ROUNDS: usize = 6;
/// From this round on windows can lose all of their weight.
const FIRST_HARD_ROUND: usize = 2;
/// Mahalanobis distance from which on a window counts less, and from which on it does not count.
const SOFT_LIMIT: f64 = 3.5;
const HARD_LIMIT: f64 = 7.0;

/// Fits the free parameters from `start`.
///
/// # Errors
/// [`FitError`].
pub fn fit(windows: &[Window], start: &VehicleModel, free: Free, noise: &NoiseModel) -> Result<JointFit, FitError> {
    let unknowns = free.unknowns();
    if 3 * windows.len() < 2 * unknowns.len() {
        return Err(FitError::TooFewWindows);
    }
    let mut model = *start;
    let mut noise_now = *noise;
    let mut weights = vec![1.0; windows.len()];
    let mut disturbed = disturbances_of(windows, &model);
    for round in 0..ROUNDS {
        let white = whitening(windows, &disturbed, &noise_now, &weights)?;
        model = solve(windows, &model, &unknowns, &white)?;
        disturbed = disturbances_of(windows, &model);
        let counted: Vec<_> =
            disturbed.iter().zip(&weights).filter(|(_, weight)| **weight > 0.0).map(|(window, _)| *window).collect();
        let before = (noise_now, weights);
        noise_now = noise.estimated(&counted, unknowns.len());
        weights = reweighted(&disturbed, &noise_now, round);
        if weights.iter().filter(|weight| **weight > 0.0).count() < unknowns.len().max(windows.len() / 3) {
            return Err(FitError::Singular);
        }
        if round >= FIRST_HARD_ROUND && before == (noise_now, weights.clone()) {
            break;
        }
    }
    let white = whitening(windows, &disturbed, &noise_now, &weights)?;
    model = solve(windows, &model, &unknowns, &white)?;
    finish(windows, model, &unknowns, &white, noise_now, weights)
}

fn disturbances_of(windows: &[Window], model: &VehicleModel) -> Vec<Disturbances> {
    windows.iter().map(|window| disturbances(window, model)).collect()
}

/// What a window contributes to the noise, given a model.
#[must_use]
pub fn disturbances(window: &Window, model: &VehicleModel) -> Disturbances {
    let (motion, derivative) = model.laser_motion(window);
    let offset = derivative.column(usize::from(window.is_backward())).into_owned();
    let measured = window.measured_near(motion.z);
    Disturbances {
        residual: measured - motion,
        slip: model.slip_covariance(window),
        steering: offset * offset.transpose(),
        laser: window.covariance(),
    }
}

fn reweighted(windows: &[Disturbances], noise: &NoiseModel, round: usize) -> Vec<f64> {
    // The first rounds come from a poor start and must not lose good windows.
    let limit = if round < FIRST_HARD_ROUND { f64::INFINITY } else { HARD_LIMIT };
    let weight = |window: &Disturbances| match window.distance(noise) {
        Some((square, _)) if square.sqrt() <= SOFT_LIMIT => 1.0,
        Some((square, _)) if square.sqrt() <= limit => SOFT_LIMIT / square.sqrt(),
        _ => 0.0,
    };
    windows.iter().map(weight).collect()
}

/// A window of weight zero is taken to be so much less certain, as a factor of its variance.
const DISMISSED: f64 = 1e6;

/// What makes the residuals of all windows white; a window of less weight is less certain.
fn whitening(
    windows: &[Window],
    disturbed: &[Disturbances],
    noise: &NoiseModel,
    weights: &[f64],
) -> Result<Whitening, FitError> {
    let covariance = |index: usize| {
        let own = disturbed[index].covariance(noise) / weights[index].max(1.0 / DISMISSED);
        let before = index.checked_sub(1).map(|before| windows[index].covariance_with(&windows[before]));
        (own, before.unwrap_or_else(Matrix3::zeros) * noise.laser.powi(2))
    };
    Whitening::new((0..windows.len()).map(covariance)).ok_or(FitError::Singular)
}

fn linearise(windows: &[Window], model: &VehicleModel, unknowns: &[Vec<usize>], whitening: &Whitening) -> Linearised {
    let (mut residuals, mut derivatives): (Vec<_>, Vec<_>) = windows
        .iter()
        .map(|window| {
            let (motion, derivative) = model.laser_motion(window);
            (motion - window.measured_near(motion.z), derivative)
        })
        .unzip();
    whitening.apply(&mut residuals);
    whitening.apply(&mut derivatives);
    let mut linearised = Linearised { residuals: Vec::new(), rows: Vec::new() };
    for (residual, derivative) in residuals.iter().zip(&derivatives) {
        linearised.residuals.extend(residual.iter());
        for row in 0..3 {
            let entry = |moved: &Vec<usize>| moved.iter().map(|column| derivative[(row, *column)]).sum::<f64>();
            linearised.rows.extend(unknowns.iter().map(entry));
        }
    }
    linearised
}

/// The model that is meant by values of the unknowns: each in units of `units`, as changes of `base`.
fn moved(base: &VehicleModel, unknowns: &[Vec<usize>], units: &[f64], values: &[f64]) -> VehicleModel {
    let mut vector = base.vector();
    for ((places, unit), value) in unknowns.iter().zip(units).zip(values) {
        for place in places {
            vector[*place] += unit * value;
        }
    }
    VehicleModel::from_vector(&vector)
}

fn solve(
    windows: &[Window],
    base: &VehicleModel,
    unknowns: &[Vec<usize>],
    white: &Whitening,
) -> Result<VehicleModel, FitError> {
    // Of one size: a tick's way is a thousand times smaller than all else.
    let units: Vec<f64> = unknowns.iter().map(|places| if places[0] == 2 { base.drive_scale } else { 1.0 }).collect();
    let mut base = *base;
    if unknowns[0].len() == 2 {
        let mean = 0.5 * (base.offset_forward + base.offset_backward);
        (base.offset_forward, base.offset_backward) = (mean, mean);
    }
    let evaluate = |values: &[f64]| {
        let mut linearised = linearise(windows, &moved(&base, unknowns, &units, values), unknowns, white);
        for row in linearised.rows.chunks_exact_mut(units.len()) {
            row.iter_mut().zip(&units).for_each(|(entry, unit)| *entry *= unit);
        }
        linearised
    };
    let found = minimise(&vec![0.0; unknowns.len()], evaluate).ok_or(FitError::NoConvergence)?;
    Ok(moved(&base, unknowns, &units, &found))
}

fn finish(
    windows: &[Window],
    model: VehicleModel,
    unknowns: &[Vec<usize>],
    white: &Whitening,
    noise: NoiseModel,
    weights: Vec<f64>,
) -> Result<JointFit, FitError> {
    let linearised = linearise(windows, &model, unknowns, white);
    let full = 3.0 * weights.iter().sum::<f64>();
    let squares: f64 = linearised.residuals.iter().map(|residual| residual * residual).sum();
    let variance = squares / (full - unknowns.len() as f64).max(1.0);
    let deviations = deviations(&linearised, unknowns, variance)?;
    if !model.vector().iter().chain(&deviations).all(|value| value.is_finite()) {
        return Err(FitError::Singular);
    }
    Ok(JointFit { model, deviations, noise, weights, normalised_rms: variance.sqrt() })
}

/// Deviations of the parameters from white residuals of that variance.
fn deviations(linearised: &Linearised, unknowns: &[Vec<usize>], variance: f64) -> Result<[f64; PARAMETERS], FitError> {
    let rows = || linearised.rows.chunks_exact(unknowns.len());
    let scales: Vec<f64> = (0..unknowns.len())
        .map(|column| rows().map(|row| row[column].powi(2)).sum::<f64>().sqrt().max(f64::MIN_POSITIVE))
        .collect();
    let mut information = SMatrix::<f64, PARAMETERS, PARAMETERS>::identity();
    for first in 0..unknowns.len() {
        for second in 0..unknowns.len() {
            let product: f64 = rows().map(|row| row[first] * row[second]).sum();
            information[(first, second)] = product / (scales[first] * scales[second]);
        }
    }
    let covariance = information.try_inverse().ok_or(FitError::Singular)?;
    let mut deviations = [0.0; PARAMETERS];
    for (index, (places, scale)) in unknowns.iter().zip(&scales).enumerate() {
        let deviation = (covariance[(index, index)] * variance).sqrt() / scale;
        for place in places {
            deviations[*place] = deviation;
        }
    }
    Ok(deviations)
}

/// The deviations that a fit of such windows will have under that noise.
///
/// # Errors
/// [`FitError::Singular`] if the windows cannot tell the unknowns apart.
pub fn expected_deviations(
    windows: &[Window],
    model: &VehicleModel,
    free: Free,
    noise: &NoiseModel,
) -> Result<[f64; PARAMETERS], FitError> {
    let unknowns = free.unknowns();
    let disturbed = disturbances_of(windows, model);
    let white = whitening(windows, &disturbed, noise, &vec![1.0; windows.len()])?;
    let deviations = deviations(&linearise(windows, model, &unknowns, &white), &unknowns, 1.0)?;
    if deviations.iter().all(|deviation| deviation.is_finite()) { Ok(deviations) } else { Err(FitError::Singular) }
}
