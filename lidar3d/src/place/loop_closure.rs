//! Has the vehicle come back to a place (M 5.2)?

use super::histogram::{Histogram, chi_square, sorensen};

/// When two signatures are of the same place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Greatest chi-square distance (M: 434, for its sensor and spin rate).
    pub chi_square: f64,
    /// Greatest Sorensen distance (M: 0.0391).
    pub sorensen: f64,
    /// Key signatures before the present one that are too recent to be a return (M: 15).
    pub recent: usize,
}

/// The number of the key signature at whose place the vehicle is again: of those within both limits the one at the least
/// Sorensen distance. `keys` are in the order in which they were stored.
#[must_use]
pub fn loop_closure(current: &Histogram, keys: &[Histogram], limits: &Limits) -> Option<usize> {
    let earlier = keys.get(..keys.len().saturating_sub(limits.recent)).unwrap_or_default();
    let candidates = earlier.iter().enumerate().filter_map(|(number, key)| {
        let distance = sorensen(current, key);
        (distance < limits.sorensen && chi_square(current, key) < limits.chi_square).then_some((number, distance))
    });
    candidates.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(number, _)| number)
}
