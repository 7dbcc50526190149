//! How badly landmarks have fitted each other of late: what the stated errors of sensor and map do not explain.

use serde::{Deserialize, Serialize};

use super::sensor_information::SensorInformation;
use crate::state::ProtectionLevel;

/// Events over which it is averaged.
const EVENTS: f64 = 24.0;
/// An excess of fewer deviations than this is chance.
const CHANCE: f64 = 3.0;

/// The misfit of one event is larger than this quantile of the normal distribution by chance once in 160 events.
const TORN: f64 = 2.5;

/// A map whose landmarks in sight are off against each other by so much may be off by so many times that as a whole: its error
/// grows from one end of the hall to the other, and a quarter of that is seen at once.
const WHOLE: f64 = 4.0;

/// Means of the last events, each of which counts by less and less.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Misfit {
    square: f64,
    freedom: f64,
    /// Variance of a number that a landmark tells, and square of the distance to landmarks, m^2.
    means: Option<(f64, f64)>,
}

impl Misfit {
    /// Nothing was seen.
    pub const NONE: Self = Self { square: 0.0, freedom: 0.0, means: None };

    /// Whether the landmarks of one event contradict each other by more than chance: one of them may be something else. The quantile of the
    /// sum of squares is that of E. Wilson and M. Hilferty, "The distribution of chi-square", 1931.
    #[must_use]
    pub fn is_torn(told: &SensorInformation) -> bool {
        let (square, freedom) = told.misfit();
        let ninth = 2.0 / (9.0 * freedom.max(1.0));
        let root = 1.0 - ninth + TORN * libm::sqrt(ninth);
        square > freedom.max(1.0) * root * root * root
    }

    /// Takes what one event tells.
    pub fn add(&mut self, told: &SensorInformation) {
        let (square, freedom) = told.misfit();
        let Some((variance, distance)) = told.means().filter(|_| square.is_finite()) else { return };
        let sum = |sum: f64, value: f64| (1.0 - 1.0 / EVENTS) * sum + value;
        (self.square, self.freedom) = (sum(self.square, square), sum(self.freedom, freedom));
        let mean = |mean: f64, value: f64| mean + (value - mean) / EVENTS;
        let (before, distance_before) = self.means.unwrap_or((variance, distance));
        self.means = Some((mean(before, variance), mean(distance_before, distance)));
    }

    /// The share by which the landmarks fit worse than expected and than chance allows; a sum of squares over `n` degrees of
    /// freedom scatters by `sqrt(2 n)`.
    fn excess(&self) -> f64 {
        if self.freedom < 1.0 {
            return 0.0;
        }
        (self.square / self.freedom - 1.0 - CHANCE * libm::sqrt(2.0 / self.freedom)).max(0.0)
    }

    /// By how much the bound is wider.
    #[must_use]
    pub fn widening(&self) -> ProtectionLevel {
        let Some((variance, distance)) = self.means else { return ProtectionLevel::NONE };
        let position = WHOLE * libm::sqrt(self.excess() * variance);
        ProtectionLevel { position, heading: position / libm::sqrt(distance.max(1.0)) }
    }
}
