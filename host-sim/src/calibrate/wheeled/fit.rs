//! All unknowns of a vehicle and the clocks of its drives at once, by least squares over windows.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use thiserror::Error;

use super::super::least_squares::{self, minimise_kinked};
use super::clock::Clock;
use super::drive::WheelDrive;
use super::path::{LinearisedPath, is_redundant};
use super::unknowns::{Unknown, WheeledModel};
use super::windows::{self, MEMORY, SECONDS, STRIDE, Window};

/// Why a fit gives nothing.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum WheeledFitError {
    /// There are fewer windows than unknowns need.
    #[error("the drives are too short for so many unknowns")]
    TooShort,
    /// The wheels, as they are described, do not determine the vehicle's motion.
    #[error("the wheels do not determine the vehicle's motion")]
    Undetermined,
    /// The solver does not converge.
    #[error("the fit does not converge")]
    NoConvergence,
}

/// One number that was fitted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fitted {
    /// Its name with its unit.
    pub name: String,
    /// Change from the nominal value.
    pub change: f64,
    /// Standard deviation.
    pub deviation: f64,
    /// Whether the drives do not tell it: it is known hardly better than before.
    pub is_open: bool,
}

/// What a fit found.
#[derive(Clone, Debug, PartialEq)]
pub struct WheeledFit {
    /// The vehicle.
    pub model: WheeledModel,
    /// Each unknown.
    pub fitted: Vec<Fitted>,
    /// The clock of each drive.
    pub clocks: Vec<Clock>,
    /// Root of the mean square of what the poses and the wheels say differently of a window, m; a heading counts as the way of a point
    /// at [`HEADING_ARM`].
    pub residual: f64,
}

/// A rotation counts as the way of a point so far away, m.
pub const HEADING_ARM: f64 = 1.0 / 3.0;
/// Believed of a clock before: offset, s, and rate.
const CLOCK: [f64; 2] = [1.5, 0.06];
/// What is known after the fit by less than this share better than before is open.
const OPEN: f64 = 0.5;
/// Residuals before the first fit, m; and never less than this.
const FIRST_RESIDUAL: f64 = 0.01;
const LEAST_RESIDUAL: f64 = 1e-13;
/// Rounds of fit and residual, at most; they end when the residual changes by less than this share.
const ROUNDS: usize = 4;
const SETTLED: f64 = 0.02;

struct Problem<'a> {
    drives: &'a [WheelDrive],
    nominal: &'a WheeledModel,
    unknowns: &'a [Unknown],
    windows: Vec<Window>,
    /// Of the vehicle's unknowns; those of the clocks follow, two a drive.
    priors: Vec<f64>,
    clocks: bool,
    /// Residuals of a window.
    rows: usize,
}

/// Fits the unknowns, and the clock of each drive if `clocks` says so.
///
/// # Errors
/// [`WheeledFitError`].
pub fn fit(
    drives: &[WheelDrive],
    nominal: &WheeledModel,
    unknowns: &[Unknown],
    clocks: bool,
) -> Result<WheeledFit, WheeledFitError> {
    let windows: Vec<Window> =
        drives.iter().enumerate().flat_map(|(number, drive)| windows::of(number, drive)).collect();
    let mut priors: Vec<f64> = unknowns.iter().map(|unknown| unknown.prior).collect();
    if clocks {
        drives.iter().for_each(|_| priors.extend(CLOCK));
    }
    if 3 * windows.len() < 2 * priors.len() || windows.is_empty() {
        return Err(WheeledFitError::TooShort);
    }
    let rows = if is_redundant(nominal) { 3 + 2 * nominal.wheels.len() } else { 3 };
    let problem = Problem { drives, nominal, unknowns, windows, priors, clocks, rows };
    let mut values = vec![0.0; problem.priors.len()];
    let mut residual = FIRST_RESIDUAL;
    for _ in 0..ROUNDS {
        values = problem.solve(&values, residual)?;
        let before = std::mem::replace(&mut residual, problem.residual(&values)?.max(LEAST_RESIDUAL));
        if (residual - before).abs() <= SETTLED * before {
            break;
        }
    }
    problem.finish(&values, residual)
}

/// The clock of a drive of a vehicle that is known.
///
/// # Errors
/// [`WheeledFitError`].
pub fn clock_of(drive: &WheelDrive, model: &WheeledModel) -> Result<Clock, WheeledFitError> {
    let fit = fit(std::slice::from_ref(drive), model, &[], true)?;
    Ok(fit.clocks.first().copied().unwrap_or_default())
}

impl Problem<'_> {
    /// Values in units of their priors into the model and the clocks.
    fn model(&self, values: &[f64]) -> (WheeledModel, Vec<Clock>) {
        let scaled: Vec<f64> = values.iter().zip(&self.priors).map(|(value, prior)| value * prior).collect();
        let (vehicle, clocks) = scaled.split_at(self.unknowns.len());
        let clock = |drive: usize| match clocks.get(2 * drive..2 * drive + 2) {
            Some([offset_s, rate]) => Clock { offset_s: *offset_s, rate: *rate },
            _ => Clock::default(),
        };
        (self.nominal.changed(self.unknowns, vehicle), (0..self.drives.len()).map(clock).collect())
    }

    /// Windows' residuals, m, with their derivatives by the values; none if the wheels do not determine the motion.
    fn windows(&self, values: &[f64]) -> Option<least_squares::Linearised> {
        let (model, clocks) = self.model(values);
        let paths: Vec<LinearisedPath> =
            self.drives.iter().map(|drive| LinearisedPath::new(drive, &model, self.unknowns)).collect::<Option<_>>()?;
        let mut linearised = least_squares::Linearised { residuals: Vec::new(), rows: Vec::new() };
        let count = self.unknowns.len();
        for window in &self.windows {
            let residual = window.residual(&paths[window.drive], &clocks[window.drive]);
            for (row, value) in residual.values.iter().enumerate() {
                let arm = if row == 2 { HEADING_ARM } else { 1.0 };
                linearised.residuals.push(arm * value);
                let mut line = vec![0.0; self.priors.len()];
                for (column, (entry, prior)) in line.iter_mut().zip(&self.priors).take(count).enumerate() {
                    *entry = arm * residual.by_unknowns[(row, column)] * prior;
                }
                for index in (0..2).filter(|_| self.clocks) {
                    let column = count + 2 * window.drive + index;
                    line[column] = arm * residual.by_clock[(row, index)] * self.priors[column];
                }
                linearised.rows.extend(line);
            }
        }
        Some(linearised)
    }

    /// What was believed before weighs as a residual does, of which overlapping windows make several.
    fn solve(&self, start: &[f64], residual: f64) -> Result<Vec<f64>, WheeledFitError> {
        let weight = residual * (SECONDS / STRIDE).sqrt();
        self.windows(start).ok_or(WheeledFitError::Undetermined)?;
        let evaluate = |values: &[f64]| {
            let not_determined = || least_squares::Linearised {
                residuals: vec![f64::MAX.sqrt(); self.rows * self.windows.len()],
                rows: vec![0.0; self.rows * self.windows.len() * values.len()],
            };
            let mut linearised = self.windows(values).unwrap_or_else(not_determined);
            for (row, value) in values.iter().enumerate() {
                linearised.residuals.push(weight * value);
                linearised.rows.extend((0..values.len()).map(|column| if column == row { weight } else { 0.0 }));
            }
            // The solver's tolerances are meant for residuals about one.
            linearised.residuals.iter_mut().chain(&mut linearised.rows).for_each(|entry| *entry /= weight);
            linearised
        };
        minimise_kinked(start, evaluate).ok_or(WheeledFitError::NoConvergence)
    }

    fn residual(&self, values: &[f64]) -> Result<f64, WheeledFitError> {
        let windows = self.windows(values).ok_or(WheeledFitError::Undetermined)?;
        let squares: f64 = windows.residuals.iter().map(|residual| residual * residual).sum();
        Ok((squares / (3 * self.windows.len()) as f64).sqrt())
    }

    fn finish(&self, values: &[f64], residual: f64) -> Result<WheeledFit, WheeledFitError> {
        let (model, clocks) = self.model(values);
        let (data, after) = self.covariances(values, residual)?;
        let fitted = self.unknowns.iter().enumerate().map(|(index, unknown)| Fitted {
            name: unknown.name.clone(),
            change: values[index] * unknown.prior,
            deviation: data[(index, index)].max(0.0).sqrt() * unknown.prior,
            is_open: after[(index, index)].sqrt() > OPEN,
        });
        Ok(WheeledFit { model, fitted: fitted.collect(), clocks, residual })
    }

    /// Covariances in units of the priors: what the scatter of the windows makes of the estimate, with what the prior leaves; and the
    /// one that independent residuals and the priors state.
    fn covariances(&self, values: &[f64], residual: f64) -> Result<(DMatrix<f64>, DMatrix<f64>), WheeledFitError> {
        let count = values.len();
        let windows = self.windows(values).ok_or(WheeledFitError::Undetermined)?;
        let weight = residual * (SECONDS / STRIDE).sqrt();
        let rows = DMatrix::from_row_slice(windows.residuals.len(), count, &windows.rows) / weight;
        let residuals = DVector::from_column_slice(&windows.residuals) / weight;
        let normal = rows.transpose() * &rows + DMatrix::identity(count, count);
        let inverse = normal.try_inverse().ok_or(WheeledFitError::Undetermined)?;
        let scores: Vec<DVector<f64>> = (0..self.windows.len())
            .map(|window| {
                rows.rows(self.rows * window, self.rows).transpose() * residuals.rows(self.rows * window, self.rows)
            })
            .collect();
        // Neighbours within the memory are correlated: their products count, the less the further apart.
        let mut scatter = DMatrix::identity(count, count);
        let reach = (MEMORY / STRIDE) as usize;
        for (index, score) in scores.iter().enumerate() {
            for lag in 0..reach.min(scores.len() - index) {
                if self.windows[index].drive == self.windows[index + lag].drive {
                    let product = score * scores[index + lag].transpose() * (1.0 - lag as f64 / reach as f64);
                    scatter += if lag == 0 { product } else { &product + product.transpose() };
                }
            }
        }
        // The scatter is seen about what was fitted: of products within the memory, a share `b` of the drive, that leaves `1 - b + b^2 / 3`
        // (N. Kiefer and T. Vogelsang, "A new asymptotic theory for heteroskedasticity-autocorrelation robust tests", 2005), and every unknown
        // takes one independent residual away.
        let seconds = self.windows.len() as f64 * STRIDE;
        let independent = 3.0 * seconds / SECONDS;
        let share = (MEMORY / seconds).min(1.0);
        let seen = (1.0 - share + share * share / 3.0) * (1.0 - count as f64 / independent).max(0.1);
        let correction = 1.0 / seen;
        Ok((&inverse * scatter * &inverse * correction, inverse))
    }
}
