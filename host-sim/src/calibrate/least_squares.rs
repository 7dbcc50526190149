//! The solver's view of a fit.

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt, TerminationReason};
use nalgebra_least_squares::storage::Owned;
use nalgebra_least_squares::{DMatrix, DVector, Dyn};

/// Residuals, and their derivatives row by row.
pub struct Linearised {
    /// Residuals.
    pub residuals: Vec<f64>,
    /// Derivatives: one row a residual.
    pub rows: Vec<f64>,
}

struct Fit<F> {
    parameters: DVector<f64>,
    linearised: Linearised,
    evaluate: F,
}

impl<F: Fn(&[f64]) -> Linearised> LeastSquaresProblem<f64, Dyn, Dyn> for Fit<F> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, parameters: &DVector<f64>) {
        self.parameters.copy_from(parameters);
        self.linearised = (self.evaluate)(parameters.as_slice());
    }

    fn params(&self) -> DVector<f64> {
        self.parameters.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        Some(DVector::from_column_slice(&self.linearised.residuals))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let linearised = &self.linearised;
        Some(DMatrix::from_row_slice(linearised.residuals.len(), self.parameters.len(), &linearised.rows))
    }
}

/// Parameters with the least squared residuals, from `start`. None if the solver fails.
pub fn minimise(start: &[f64], evaluate: impl Fn(&[f64]) -> Linearised) -> Option<Vec<f64>> {
    solve(LevenbergMarquardt::new(), start, evaluate, TerminationReason::was_successful)
}

/// A step that makes the squared residuals less by a smaller share is none: along a kink there are hundreds of such steps, each of
/// which moves the parameters by about a hundredth of their deviations.
const NO_IMPROVEMENT: f64 = 1e-6;

/// The same for residuals with kinks, of which the least one has no slope that a solver could find to be zero: where no step makes
/// them less is the solution.
pub fn minimise_kinked(start: &[f64], evaluate: impl Fn(&[f64]) -> Linearised) -> Option<Vec<f64>> {
    let is_found = |reason: &TerminationReason| {
        reason.was_successful() || matches!(reason, TerminationReason::NoImprovementPossible(_))
    };
    solve(LevenbergMarquardt::new().with_ftol(NO_IMPROVEMENT), start, evaluate, is_found)
}

fn solve(
    solver: LevenbergMarquardt<f64>,
    start: &[f64],
    evaluate: impl Fn(&[f64]) -> Linearised,
    is_found: impl Fn(&TerminationReason) -> bool,
) -> Option<Vec<f64>> {
    let linearised = evaluate(start);
    let fit = Fit { parameters: DVector::from_column_slice(start), linearised, evaluate };
    let (fit, report) = solver.minimize(fit);
    is_found(&report.termination).then(|| fit.parameters.as_slice().to_vec())
}
