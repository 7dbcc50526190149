//! Which landmark an observation belongs to.

use serde::{Deserialize, Serialize};

/// What became of an observation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// It corrected the pose.
    Accepted,
    /// The nearest landmark is further than the gate allows.
    Gated,
    /// Two landmarks fit almost equally.
    Ambiguous,
    /// There is no landmark near it.
    Unknown,
    /// It is older, or newer, than what the filter can take.
    OutOfTime,
}

/// The landmark that fits best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match<T> {
    /// The landmark.
    pub landmark: T,
    /// Squared Mahalanobis distance.
    pub normalised_square: f64,
}

/// Nearest neighbour by Mahalanobis distance with a gate and a test that there is no second one.
#[derive(Clone, Copy, Debug)]
pub struct NearestNeighbour<T> {
    best: Option<Match<T>>,
    second: f64,
}

impl<T> Default for NearestNeighbour<T> {
    fn default() -> Self {
        Self { best: None, second: f64::INFINITY }
    }
}

impl<T> NearestNeighbour<T> {
    /// Considers a landmark at that squared Mahalanobis distance.
    #[inline]
    pub fn consider(&mut self, landmark: T, normalised_square: f64) {
        match &self.best {
            Some(best) if normalised_square >= best.normalised_square => {
                self.second = self.second.min(normalised_square);
            }
            _ => {
                if let Some(best) = self.best.replace(Match { landmark, normalised_square }) {
                    self.second = best.normalised_square;
                }
            }
        }
    }

    /// The verdict: the best landmark must lie within `gate` (squared Mahalanobis distance), and the second best must be
    /// further away than the best by `margin`.
    #[must_use]
    #[inline]
    pub fn decide(self, gate: f64, margin: f64) -> (Option<Match<T>>, Verdict) {
        let verdict = match &self.best {
            None => Verdict::Unknown,
            Some(best) if best.normalised_square > gate => Verdict::Gated,
            Some(best) if self.second - best.normalised_square < margin => Verdict::Ambiguous,
            Some(_) => Verdict::Accepted,
        };
        (self.best, verdict)
    }
}
