//! How badly landmarks have fitted each other of late: what the stated errors of sensor and map do not explain.

use super::sensor_information::SensorInformation;

/// Events over which it is averaged.
const EVENTS: f64 = 24.0;
/// An excess of fewer deviations than this is chance.
const CHANCE: f64 = 3.0;

/// Sums of the last events, each of which counts by less and less.
#[derive(Clone, Copy, Debug)]
pub struct Misfit {
    square: f64,
    freedom: f64,
}

impl Misfit {
    /// Nothing was seen.
    pub const NONE: Self = Self { square: 0.0, freedom: 0.0 };

    /// Takes what one event tells.
    pub fn add(&mut self, told: &SensorInformation) {
        let (square, freedom) = told.misfit();
        if square.is_finite() {
            let add = |sum: f64, value: f64| (1.0 - 1.0 / EVENTS) * sum + value;
            (self.square, self.freedom) = (add(self.square, square), add(self.freedom, freedom));
        }
    }

    /// The share by which the landmarks fit worse than expected and than chance allows; a sum of squares over `n` degrees of
    /// freedom scatters by `sqrt(2 n)`.
    #[must_use]
    pub fn excess(&self) -> f64 {
        if self.freedom < 1.0 {
            return 0.0;
        }
        (self.square / self.freedom - 1.0 - CHANCE * libm::sqrt(2.0 / self.freedom)).max(0.0)
    }
}
