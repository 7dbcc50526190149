//! A covariance of many states, of which the lower triangle is kept.

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use super::Linearisation;
use super::slots::{PoseOnly, Slots, Storage, storage};

/// The covariance of all states of a filter with room for `S`, row by row up to the diagonal.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct PackedCovariance<S: Slots> {
    #[serde(with = "storage")]
    entries: S::Covariance,
}

impl Copy for PackedCovariance<PoseOnly> {}

impl<S: Slots> PackedCovariance<S> {
    /// All states are known exactly.
    #[must_use]
    #[inline(always)]
    pub fn zero() -> Self {
        Self { entries: S::Covariance::empty() }
    }

    /// Covariance of two states; zero if one of them does not exist.
    #[must_use]
    pub fn get(&self, first: usize, second: usize) -> f64 {
        self.entries.as_ref().get(place(first, second)).copied().unwrap_or(0.0)
    }

    /// Sets the covariance of two states, and so of the second and the first.
    pub fn set(&mut self, first: usize, second: usize, value: f64) {
        if let Some(entry) = self.entries.as_mut().get_mut(place(first, second)) {
            *entry = value;
        }
    }

    /// Makes a state exactly known and independent of all others.
    pub fn clear(&mut self, state: usize) {
        for other in 0..S::STATES {
            self.set(state, other, 0.0);
        }
    }

    /// Covariance of the first `count` states with the expectation of an observation: `P H'`, with the zeros of `H` left
    /// out.
    #[must_use]
    pub fn cross<const SIZE: usize>(&self, observation: &Linearisation<SIZE>, count: usize) -> S::Rows<SIZE> {
        let mut rows = S::Rows::<SIZE>::empty();
        let cross = rows.as_mut();
        let [by_x, by_y, by_heading] = &observation.by_pose;
        for (other, sum) in cross.iter_mut().enumerate().take(count) {
            *sum = by_x * self.get(0, other) + by_y * self.get(1, other) + by_heading * self.get(2, other);
        }
        for (state, derivative) in &observation.terms {
            // The row of the state up to the diagonal, then its column.
            let start = place(*state, 0);
            let row = self.entries.as_ref().get(start..=start + state).unwrap_or_default();
            for (entry, sum) in row.iter().zip(cross.iter_mut()) {
                *sum += derivative * *entry;
            }
            let mut below = start + 2 * state + 1;
            for (other, sum) in cross.iter_mut().enumerate().take(count).skip(state + 1) {
                *sum += derivative * self.entries.as_ref().get(below).copied().unwrap_or(0.0);
                below += other + 1;
            }
        }
        rows
    }

    /// Subtracts `W W'` from the covariance of the first `count` states; a row of `W` is a state's share.
    pub fn subtract<const SIZE: usize>(&mut self, shares: &[SVector<f64, SIZE>], count: usize) {
        let mut rest = self.entries.as_mut();
        for (state, share) in shares.iter().enumerate().take(count) {
            let Some((row, below)) = rest.split_at_mut_checked(state + 1) else { return };
            for (entry, other) in row.iter_mut().zip(shares) {
                *entry -= share.dot(other);
            }
            rest = below;
        }
    }
}

/// Where the covariance of two states is kept.
fn place(first: usize, second: usize) -> usize {
    let (row, column) = if first >= second { (first, second) } else { (second, first) };
    row * (row + 1) / 2 + column
}
