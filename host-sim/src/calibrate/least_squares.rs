//! The solver's view of a fit.

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
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
    let linearised = evaluate(start);
    let fit = Fit { parameters: DVector::from_column_slice(start), linearised, evaluate };
    let (fit, report) = LevenbergMarquardt::new().minimize(fit);
    report.termination.was_successful().then(|| fit.parameters.as_slice().to_vec())
}
