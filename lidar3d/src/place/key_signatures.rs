//! Which scans of a drive are worth storing (M 5.1.5).

use super::histogram::{Histogram, chi_square};

/// Scans from which the threshold is learned.
const LEARNING: usize = 20;
/// A key signature is so many times as far from the last one as the first scans are from their neighbours, at the median.
const FACTOR: f64 = 3.0;

/// Chooses key signatures by their chi-square distance from the last one. M's threshold of 380 is for one sensor and one
/// speed of its head; this one is learned from the first scans.
#[derive(Clone, Debug, Default)]
pub struct KeySignatures {
    last_key: Option<Histogram>,
    last: Option<Histogram>,
    steps: [f64; LEARNING],
    learned: usize,
}

impl KeySignatures {
    /// With a threshold that is known (M: 380).
    #[must_use]
    pub fn with_threshold(threshold: f64) -> Self {
        Self { steps: [threshold / FACTOR; LEARNING], learned: LEARNING, ..Self::default() }
    }

    /// Whether the next scan of the drive is a key scan. The first is one; while the threshold is not yet known no other
    /// is.
    pub fn is_key(&mut self, signature: &Histogram) -> bool {
        let step = self.last.as_ref().map(|last| chi_square(last, signature));
        self.last = Some(*signature);
        if let (Some(step), Some(target)) = (step, self.steps.get_mut(self.learned)) {
            *target = step;
            self.learned += 1;
            self.steps.get_mut(..self.learned).unwrap_or_default().sort_unstable_by(f64::total_cmp);
        }
        let is_key = match &self.last_key {
            None => true,
            Some(key) => self.threshold().is_some_and(|threshold| chi_square(key, signature) > threshold),
        };
        if is_key {
            self.last_key = Some(*signature);
        }
        is_key
    }

    /// The threshold, once it is known.
    #[must_use]
    pub fn threshold(&self) -> Option<f64> {
        let median = self.steps.get(LEARNING / 2)?;
        (self.learned == LEARNING).then_some(FACTOR * median)
    }
}
