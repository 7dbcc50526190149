//! The root of a small covariance.

use nalgebra::{SMatrix, SVector};

/// The lower triangular root of a symmetric positive matrix; of its diagonal the inverse is kept.
#[derive(Clone, Copy, Debug)]
pub(super) struct Root<const SIZE: usize>([[f64; SIZE]; SIZE]);

impl<const SIZE: usize> Root<SIZE> {
    /// None if the matrix is not positive, or not finite.
    pub fn of(matrix: &SMatrix<f64, SIZE, SIZE>) -> Option<Self> {
        let mut rows = [[0.0; SIZE]; SIZE];
        for row in 0..SIZE {
            let (above, rest) = rows.split_at_mut_checked(row)?;
            let (own, _) = rest.split_first_mut()?;
            for (column, other) in above.iter().enumerate() {
                let sum = inner(own, other, column);
                *own.get_mut(column)? = (matrix.get((row, column))? - sum) * other.get(column)?;
            }
            let square = matrix.get((row, row))? - inner(own, own, row);
            if !(square > 0.0 && square.is_finite()) {
                return None;
            }
            *own.get_mut(row)? = 1.0 / libm::sqrt(square);
        }
        Some(Self(rows))
    }

    /// The inverse of the root times a vector: in its units the covariance is one.
    pub fn whiten(&self, vector: &SVector<f64, SIZE>) -> SVector<f64, SIZE> {
        let mut whitened = [0.0; SIZE];
        for (index, (row, value)) in self.0.iter().zip(vector.iter()).enumerate() {
            let rest = value - inner(row, &whitened, index);
            if let (Some(place), Some(inverse)) = (whitened.get_mut(index), row.get(index)) {
                *place = rest * inverse;
            }
        }
        SVector::from(whitened)
    }
}

/// Inner product of the first `count` numbers.
fn inner<const SIZE: usize>(first: &[f64; SIZE], second: &[f64; SIZE], count: usize) -> f64 {
    first.iter().zip(second).take(count).fold(0.0, |sum, (one, other)| sum + one * other)
}
