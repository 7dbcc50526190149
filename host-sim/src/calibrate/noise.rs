//! How much the windows disagree, and why: estimated from the residuals.

use nalgebra::{Matrix3, Vector3};

/// Standard deviations of what disturbs a window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseModel {
    /// Slip of the driving wheel, a random walk, m for the root of a metre.
    pub slip: f64,
    /// Error of the steering angle that stays for a window, rad.
    pub steering: f64,
    /// Factor of the stated deviation of the laser's motion.
    pub laser: f64,
}

impl Default for NoiseModel {
    /// A good floor and a good encoder, between those of the standard simulation.
    fn default() -> Self {
        Self { slip: 5e-4, steering: 1.7e-4, laser: 1.0 }
    }
}

/// What one window contributes: its residual, and its covariance for a unit of each disturbance.
#[derive(Clone, Copy, Debug)]
pub struct Disturbances {
    /// Measured motion minus the model's.
    pub residual: Vector3<f64>,
    /// Answer to slip, for 1 m^2 a metre.
    pub slip: Matrix3<f64>,
    /// Answer to the steering angle, for 1 rad^2.
    pub steering: Matrix3<f64>,
    /// Stated covariance of the laser's motion.
    pub laser: Matrix3<f64>,
}

impl Disturbances {
    /// Covariance of the residual.
    #[must_use]
    pub fn covariance(&self, noise: &NoiseModel) -> Matrix3<f64> {
        self.slip * noise.slip.powi(2) + self.steering * noise.steering.powi(2) + self.laser * noise.laser.powi(2)
    }

    /// Squared Mahalanobis distance of the residual, and logarithm of the covariance's determinant.
    #[must_use]
    pub fn distance(&self, noise: &NoiseModel) -> Option<(f64, f64)> {
        let root = self.covariance(noise).cholesky()?.l();
        let white = root.solve_lower_triangular(&self.residual)?;
        Some((white.norm_squared(), 2.0 * root.diagonal().map(f64::ln).sum()))
    }
}

/// Standard deviations, in powers of e, of what is believed of slip, steering and laser before the drive.
const PRIOR: [f64; 3] = [1.0, 1.0, 0.5];
/// Steps of the search, in powers of e, and how often each is tried.
const STEPS: [f64; 3] = [0.8, 0.3, 0.1];
const ROUNDS: usize = 8;
/// Mahalanobis distance beyond which the cost of a window grows in proportion (Huber): one bad window must not make all
/// others uncertain.
const HUBER: f64 = 4.0;

impl NoiseModel {
    /// The most probable deviations for those residuals, with a wide belief around `self`. `unknowns` of the residuals'
    /// degrees of freedom are used up by the fit.
    #[must_use]
    pub fn estimated(&self, windows: &[Disturbances], unknowns: usize) -> Self {
        let residuals = 3 * windows.len();
        let freedom = residuals.saturating_sub(unknowns).max(1) as f64 / residuals.max(1) as f64;
        let model = |powers: &[f64; 3]| Self {
            slip: self.slip * powers[0].exp(),
            steering: self.steering * powers[1].exp(),
            laser: self.laser * powers[2].exp(),
        };
        let cost = |powers: &[f64; 3]| -> f64 {
            let noise = model(powers);
            let belief: f64 = powers.iter().zip(PRIOR).map(|(power, prior)| (power / prior).powi(2)).sum();
            let evidence: f64 = windows
                .iter()
                .map(|window| match window.distance(&noise) {
                    Some((square, determinant)) => huber(square) + freedom * determinant,
                    None => f64::INFINITY,
                })
                .sum();
            evidence + belief
        };
        let mut powers = [0.0; 3];
        let mut best = cost(&powers);
        for step in STEPS {
            for _ in 0..ROUNDS {
                let before = best;
                for axis in 0..3 {
                    for sign in [1.0, -1.0] {
                        let mut tried = powers;
                        tried[axis] += sign * step;
                        let found = cost(&tried);
                        if found < best {
                            (best, powers) = (found, tried);
                        }
                    }
                }
                if best >= before {
                    break;
                }
            }
        }
        model(&powers)
    }
}

/// Cost of a squared distance.
fn huber(square: f64) -> f64 {
    if square <= HUBER * HUBER { square } else { HUBER * (2.0 * square.sqrt() - HUBER) }
}
