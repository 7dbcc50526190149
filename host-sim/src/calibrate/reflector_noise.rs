//! How well a stop knows where its reflectors are.

use agv_core::geometry::{Point, Pose};
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector2};

/// Standard deviations of one sighting, and of what does not average.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReflectorNoise {
    /// Of a distance, m.
    pub range: f64,
    /// Of a direction, rad.
    pub bearing: f64,
    /// Of a place along each axis, the same in all sightings of a stop, m.
    pub lasting: f64,
}

/// The mean of a reflector's sightings at a stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeanPoint {
    /// Place in S, m.
    pub point: Point,
    /// Sightings.
    pub count: usize,
}

/// A place is not better known than this, m: lasers report whole millimetres, and the wheel is counted in whole ticks.
const FINEST: f64 = 2e-4;

impl ReflectorNoise {
    /// Covariance of a mean, in S.
    #[must_use]
    pub fn covariance(&self, mean: &MeanPoint) -> Matrix2<f64> {
        let range = mean.point.norm();
        let count = mean.count as f64;
        let along = mean.point / range.max(1e-3);
        let across = Vector2::new(-along.y, along.x);
        let isotropic = self.lasting.powi(2) + FINEST * FINEST;
        along * along.transpose() * (self.range.powi(2) / count)
            + across * across.transpose() * ((self.bearing * range).powi(2) / count)
            + Matrix2::identity() * isotropic
    }
}

/// A motion by weighted least squares.
#[derive(Clone, Copy, Debug)]
pub struct WeightedMotion {
    /// The second pose in the first.
    pub motion: Pose,
    /// What the errors of the points at either stop contribute to the covariance of the motion (x, y, rotation).
    pub parts: [Matrix3<f64>; 2],
    /// Sum of squared residuals, m^2, and what the noise lets expect of it without its lasting part.
    pub squares: [f64; 2],
}

/// Steps of Gauss and Newton from the closed form, which is near.
const STEPS: usize = 3;

/// The motion between two stops from pairs of means, each weighted by what is known of it.
#[must_use]
pub fn weighted_motion(
    pairs: &[(MeanPoint, MeanPoint)],
    start: &Pose,
    noise: &ReflectorNoise,
) -> Option<WeightedMotion> {
    let mut motion = *start;
    for _ in 0..STEPS {
        let (mut information, mut right) = (Matrix3::zeros(), nalgebra::Vector3::zeros());
        for pair in pairs {
            let (residual, jacobian, [first, second]) = linearised(pair, &motion, noise);
            let weight = (first + second).try_inverse()?;
            information += jacobian.transpose() * weight * jacobian;
            right += jacobian.transpose() * weight * residual;
        }
        let step = information.try_inverse()? * right;
        motion = Pose::new(motion.x + step.x, motion.y + step.y, motion.theta + step.z);
    }
    let mut information = Matrix3::zeros();
    let mut parts = [Matrix3::zeros(); 2];
    let mut squares = [0.0; 2];
    let averaging = ReflectorNoise { lasting: 0.0, ..*noise };
    for pair in pairs {
        let (residual, jacobian, covariances) = linearised(pair, &motion, noise);
        let weight = (covariances[0] + covariances[1]).try_inverse()?;
        let gain = jacobian.transpose() * weight;
        information += gain * jacobian;
        for (part, covariance) in parts.iter_mut().zip(covariances) {
            *part += gain * covariance * gain.transpose();
        }
        squares[0] += residual.norm_squared();
        squares[1] += averaging.covariance(&pair.0).trace() + averaging.covariance(&pair.1).trace();
    }
    let inverse = information.try_inverse()?;
    Some(WeightedMotion { motion, parts: parts.map(|part| inverse * part * inverse), squares })
}

type LinearisedPair = (Vector2<f64>, Matrix2x3<f64>, [Matrix2<f64>; 2]);

/// Residual of a pair in the first S, its derivative by the motion (negated), and the covariances of both ends.
fn linearised((first, second): &(MeanPoint, MeanPoint), motion: &Pose, noise: &ReflectorNoise) -> LinearisedPair {
    let (sine, cosine) = motion.theta.sin_cos();
    let turn = Matrix2::new(cosine, -sine, sine, cosine);
    let turned = turn * second.point;
    let residual = first.point - turned - motion.position();
    let jacobian = Matrix2x3::new(1.0, 0.0, -turned.y, 0.0, 1.0, turned.x);
    (residual, jacobian, [noise.covariance(first), turn * noise.covariance(second) * turn.transpose()])
}
