//! A smooth random function of the place: a sum of waves of random directions, lengths and phases. With many waves it is
//! Gaussian, with the covariance `deviation^2 exp(-d^2 / (2 length^2))` of two places at a distance `d` (A. Rahimi, B. Recht,
//! "Random features for large-scale kernel machines", NIPS 2007, algorithm 1).

use agv_core::geometry::Point;

use super::random::Random;

/// So many that the deviation of a field is that which is stated, to a tenth.
const WAVES: usize = 100;

struct Wave {
    /// rad/m along both axes.
    number: Point,
    /// rad.
    phase: f64,
}

/// One function that was drawn.
pub struct RandomField {
    waves: Vec<Wave>,
    amplitude: f64,
}

impl RandomField {
    /// A function of that standard deviation, and with that correlation length, m. One that is nought everywhere takes no random numbers.
    #[must_use]
    pub fn new(deviation: f64, length: f64, random: &mut Random) -> Self {
        let count = if deviation > 0.0 && length > 0.0 { WAVES } else { 0 };
        let mut wave = |_| Wave {
            number: Point::new(random.normal(), random.normal()) / length,
            phase: random.between(0.0, std::f64::consts::TAU),
        };
        Self { waves: (0..count).map(&mut wave).collect(), amplitude: deviation * libm::sqrt(2.0 / WAVES as f64) }
    }

    /// Its value at a place, m.
    #[must_use]
    pub fn at(&self, place: &Point) -> f64 {
        let of_wave = |wave: &Wave| libm::cos(wave.number.dot(place) + wave.phase);
        self.amplitude * self.waves.iter().map(of_wave).sum::<f64>()
    }

    /// Its gradient at a place, of a metre.
    #[must_use]
    pub fn gradient(&self, place: &Point) -> Point {
        let of_wave = |wave: &Wave| -wave.number * libm::sin(wave.number.dot(place) + wave.phase);
        self.amplitude * self.waves.iter().map(of_wave).sum::<Point>()
    }
}

#[cfg(test)]
mod tests {
    use agv_core::geometry::Point;

    use super::RandomField;
    use crate::simulate::random::{Random, Stream};

    /// Over many fields, against the closed form.
    #[test]
    fn covariance_and_gradient_are_those_which_are_stated() {
        const FIELDS: u64 = 2000;
        let (deviation, length) = (0.3, 4.0);
        let places = [0.0, 2.0, 4.0, 8.0, 20.0].map(|along| Point::new(7.0 + 0.6 * along, -3.0 + 0.8 * along));
        let mut covariances = [0.0; 5];
        for seed in 0..FIELDS {
            let field = RandomField::new(deviation, length, &mut Random::new(seed, Stream::Floor));
            for (covariance, place) in covariances.iter_mut().zip(&places) {
                *covariance += field.at(&places[0]) * field.at(place) / FIELDS as f64;
            }
            let step = 1e-6;
            let difference =
                |offset: Point| (field.at(&(places[1] + offset)) - field.at(&(places[1] - offset))) / (2.0 * step);
            let found = Point::new(difference(Point::new(step, 0.0)), difference(Point::new(0.0, step)));
            assert!((field.gradient(&places[1]) - found).norm() < 1e-8);
        }
        for (covariance, distance) in covariances.iter().zip([0.0_f64, 2.0, 4.0, 8.0, 20.0]) {
            let expected = deviation * deviation * (-0.5 * (distance / length).powi(2)).exp();
            // Four deviations of a mean of so many products.
            let tolerance = 4.0 * deviation * deviation * libm::sqrt(2.0 / FIELDS as f64);
            assert!((covariance - expected).abs() < tolerance, "{distance} m: {covariance}, {expected}");
        }
    }

    #[test]
    fn no_field_takes_no_random_numbers() {
        let mut random = Random::new(1, Stream::Floor);
        let field = RandomField::new(0.0, 4.0, &mut random);
        assert_eq!((field.at(&Point::new(1.0, 2.0)), field.gradient(&Point::new(1.0, 2.0))), (0.0, Point::zeros()));
        assert_eq!(random.uniform(), Random::new(1, Stream::Floor).uniform());
    }
}
