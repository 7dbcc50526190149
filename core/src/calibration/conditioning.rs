//! How well the segments tell the intrinsic parameters apart.

use super::intrinsic::Normal;
use super::segment::Segment;

/// Condition numbers of the rotations' equations. One is best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conditioning {
    /// Of the matrix of the equations itself (K: A), the quotient of its singular values.
    pub equations: f64,
    /// Of the normal equations (A^T A): the square of the above, which is what K 2.41 prints.
    pub normal_equations: f64,
}

impl Conditioning {
    /// Condition numbers for those segments; infinite if the parameters cannot be told apart.
    #[must_use]
    pub fn of(segments: &[Segment]) -> Self {
        let (greater, smaller) = Normal::of(segments.iter()).eigenvalues();
        let normal_equations = if smaller > 0.0 { greater / smaller } else { f64::INFINITY };
        Self { equations: libm::sqrt(normal_equations), normal_equations }
    }
}
