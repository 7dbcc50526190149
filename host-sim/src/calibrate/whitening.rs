//! What makes the residuals of all windows white, where neighbours share the error of the stop between them.

use nalgebra::{Matrix3, SMatrix};

/// The inverse of the lower root of a covariance of blocks of three, each correlated with the one before only.
#[derive(Clone, Debug)]
pub struct Whitening {
    /// For each block the inverse of its own root, and the root's block to the left of it.
    blocks: Vec<(Matrix3<f64>, Matrix3<f64>)>,
}

impl Whitening {
    /// From the covariance of each block, and its covariance with the block before. None if that is no covariance.
    #[must_use]
    pub fn new(covariances: impl Iterator<Item = (Matrix3<f64>, Matrix3<f64>)>) -> Option<Self> {
        let mut blocks: Vec<(Matrix3<f64>, Matrix3<f64>)> = Vec::new();
        for (own, with_last) in covariances {
            let left = blocks.last().map_or_else(Matrix3::zeros, |(inverse, _)| with_last * inverse.transpose());
            let root = (own - left * left.transpose()).cholesky()?.l();
            blocks.push((root.solve_lower_triangular(&Matrix3::identity())?, left));
        }
        Some(Self { blocks })
    }

    /// Makes values white that are given block by block.
    pub fn apply<const COLUMNS: usize>(&self, values: &mut [SMatrix<f64, 3, COLUMNS>]) {
        let mut last = SMatrix::<f64, 3, COLUMNS>::zeros();
        for (value, (inverse, left)) in values.iter_mut().zip(&self.blocks) {
            *value = inverse * (*value - left * last);
            last = *value;
        }
    }
}
