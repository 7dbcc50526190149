//! An observation model of many states that depends on few of them.

use heapless::Vec;
use nalgebra::{SMatrix, SVector};

/// Most states on which one observation depends: two poses and a yaw.
pub const TERMS: usize = 8;

/// An observation of `SIZE` numbers, linearised at a state.
#[derive(Clone, Debug)]
pub struct SparseLinearisation<const SIZE: usize> {
    /// Observation minus expectation.
    pub residual: SVector<f64, SIZE>,
    /// The states on which the expectation depends, each once and with its derivative.
    pub terms: Vec<(usize, SVector<f64, SIZE>), TERMS>,
    /// Covariance of the observation.
    pub covariance: SMatrix<f64, SIZE, SIZE>,
}

impl<const SIZE: usize> SparseLinearisation<SIZE> {
    /// A residual with its covariance that depends on nothing yet.
    #[must_use]
    pub fn new(residual: SVector<f64, SIZE>, covariance: SMatrix<f64, SIZE, SIZE>) -> Self {
        Self { residual, terms: Vec::new(), covariance }
    }

    /// The same, depending on a further state by `derivative`. More than [`TERMS`] are left out.
    #[must_use]
    pub fn with(mut self, state: usize, derivative: SVector<f64, SIZE>) -> Self {
        let _ = self.terms.push((state, derivative));
        self
    }
}
