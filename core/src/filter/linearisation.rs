//! An observation model, linearised at a state.

use heapless::Vec;
use nalgebra::{SMatrix, SVector};

/// Most states beside the pose on which one observation depends: a past pose and a yaw.
pub const TERMS: usize = 4;

/// An observation of `SIZE` numbers, linearised at a state of which it needs few entries.
#[derive(Clone, Debug)]
pub struct Linearisation<const SIZE: usize> {
    /// Observation minus expectation.
    pub residual: SVector<f64, SIZE>,
    /// Derivatives of the expectation by x, y and heading (K: the columns of H).
    pub by_pose: [SVector<f64, SIZE>; 3],
    /// The other states on which the expectation depends, each once and with its derivative.
    pub terms: Vec<(usize, SVector<f64, SIZE>), TERMS>,
    /// Covariance of the observation (K: Q), and of a landmark's position that is not in the state.
    pub covariance: SMatrix<f64, SIZE, SIZE>,
}

impl<const SIZE: usize> Linearisation<SIZE> {
    /// A residual with its covariance that depends on nothing yet.
    #[must_use]
    pub fn new(residual: SVector<f64, SIZE>, covariance: SMatrix<f64, SIZE, SIZE>) -> Self {
        Self { residual, by_pose: [SVector::zeros(); 3], terms: Vec::new(), covariance }
    }

    /// The same, depending on a further state by `derivative`. More than [`TERMS`] beside the pose are left out.
    #[must_use]
    pub fn with(mut self, state: usize, derivative: SVector<f64, SIZE>) -> Self {
        self.add(state, derivative);
        self
    }

    pub(super) fn add(&mut self, state: usize, derivative: SVector<f64, SIZE>) {
        match self.by_pose.get_mut(state) {
            Some(place) => *place = derivative,
            None => {
                let _ = self.terms.push((state, derivative));
            }
        }
    }
}
