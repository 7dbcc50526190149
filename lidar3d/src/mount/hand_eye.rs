//! Heading and place of a sensor on a vehicle by motions of both: hand-eye calibration in the plane.
//!
//! If the sensor's pose on the vehicle is X, and the vehicle moves by V while the sensor moves by S, then V X = X S. The turns
//! of both are equal; the ways give two equations for each pair of motions, (R - I) x + s v = R(yaw) u, where R is the turn, x
//! the place, v the way of the vehicle by its odometry, u that of the sensor, and s the scale of the odometry.

use std::vec::Vec;

use nalgebra::{Matrix2x4, Matrix4, SymmetricEigen, Vector2, Vector4};

/// Motions that stand together when deviations are estimated: errors of neighbouring ones are not independent.
const BLOCK: usize = 4;
/// Fewer blocks say nothing of the deviations together: each motion counts by itself.
const LEAST_BLOCKS: usize = 8;
/// Fewest motions.
const LEAST_MOTIONS: usize = 4;
/// Gauss-Newton steps.
const STEPS: usize = 20;
/// A motion whose residual is more than this many robust deviations off is left out.
const OUTLIER: f64 = 4.0;
/// A direction of the parameters is determined if its information is more than that of this many motions, each with a sine of
/// its turn of one for the place, or a way of one metre for the rest.
const LEAST_INFORMATION: f64 = 0.05;
/// Share of a parameter in what is not determined, from which on it is left open.
const OPEN: f64 = 0.1;

/// How far the sensor and the vehicle have moved in the same time, each in its own frame at the beginning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Way of the sensor, m.
    pub sensor: [f64; 2],
    /// Way of the vehicle by its odometry, m.
    pub vehicle: [f64; 2],
    /// Turn of both, as the sensor has seen it, rad, counter-clockwise.
    pub turn: f64,
    /// The same by the odometry.
    pub odometry_turn: f64,
}

/// A value with its standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Known {
    /// The value, m, rad or without unit.
    pub value: f64,
    /// Its standard deviation by the residuals.
    pub deviation: f64,
}

/// What a drive tells of a sensor's mount; None of what it leaves open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandEye {
    /// Turn of the sensor on the vehicle, rad, counter-clockwise.
    pub yaw: Option<Known>,
    /// How far ahead of the vehicle's logical point it is, m.
    pub x: Option<Known>,
    /// How far to its left, m.
    pub y: Option<Known>,
    /// How much longer ways are than the odometry says, as a factor.
    pub scale: Option<Known>,
    /// Standard deviation of a way from the equations, m.
    pub residual: f64,
    /// Root mean square difference of the turns, rad.
    pub turn_residual: f64,
    /// Motions that were used, and all of them.
    pub motions: [usize; 2],
}

/// Solves for the mount by least squares; motions that contradict the others are left out. None if there are fewer than four.
#[must_use]
pub fn hand_eye(motions: &[Motion]) -> Option<HandEye> {
    let mut used: Vec<&Motion> = motions.iter().collect();
    let mut solved = Solved::of(&used)?;
    for _ in 0..STEPS {
        let limit = OUTLIER * solved.median_residual(&used).max(1e-9);
        let kept: Vec<&Motion> =
            motions.iter().filter(|motion| solved.residual(motion).norm() <= limit.max(1e-6)).collect();
        if kept.len() == used.len() || kept.len() < LEAST_MOTIONS {
            break;
        }
        used = kept;
        solved = Solved::of(&used)?;
    }
    let open = solved.open(&used);
    let covariance = solved.covariance(&used, &open);
    let known = |at: usize| {
        let is_open = open.iter().any(|direction| direction[at].abs() > OPEN);
        (!is_open).then(|| Known { value: solved.parameters[at], deviation: covariance[(at, at)].max(0.0).sqrt() })
    };
    let squares: f64 = used.iter().map(|motion| solved.residual(motion).norm_squared()).sum();
    let turns: f64 = used.iter().map(|motion| (motion.turn - motion.odometry_turn).powi(2)).sum();
    Some(HandEye {
        yaw: known(0).map(|yaw| Known { value: wrapped(yaw.value), ..yaw }),
        x: known(1),
        y: known(2),
        scale: known(3),
        residual: (squares / (2.0 * used.len() as f64 - 4.0).max(1.0)).sqrt(),
        turn_residual: (turns / used.len() as f64).sqrt(),
        motions: [used.len(), motions.len()],
    })
}

fn wrapped(angle: f64) -> f64 {
    let (sin, cos) = angle.sin_cos();
    sin.atan2(cos)
}

fn turned([x, y]: [f64; 2], angle: f64) -> Vector2<f64> {
    let (sin, cos) = angle.sin_cos();
    Vector2::new(x * cos - y * sin, x * sin + y * cos)
}

/// Yaw, x, y and scale.
struct Solved {
    parameters: Vector4<f64>,
}

impl Solved {
    fn of(motions: &[&Motion]) -> Option<Self> {
        if motions.len() < LEAST_MOTIONS {
            return None;
        }
        // From any yaw the equations lead to the right one or to its opposite, of negative scale: both are tried.
        let ends = [0.0, 1.0, 2.0, 3.0].map(|quarter| Self::from(motions, quarter * core::f64::consts::FRAC_PI_2));
        let cost = |solved: &Self| -> f64 { motions.iter().map(|motion| solved.residual(motion).norm_squared()).sum() };
        let forward = ends.into_iter().filter(|solved| solved.parameters[3] > 0.0);
        forward.min_by(|a, b| cost(a).total_cmp(&cost(b)))
    }

    fn from(motions: &[&Motion], yaw: f64) -> Self {
        let mut solved = Self { parameters: Vector4::new(yaw, 0.0, 0.0, 1.0) };
        for _ in 0..STEPS {
            let (mut information, mut sum) = (Matrix4::zeros(), Vector4::zeros());
            for motion in motions {
                let rows = solved.jacobian(motion);
                information += rows.transpose() * rows;
                sum -= rows.transpose() * solved.residual(motion);
            }
            // What is not determined stays where it is.
            let held = SymmetricEigen::new(information);
            let floor = LEAST_INFORMATION;
            let mut step = Vector4::zeros();
            for (value, direction) in held.eigenvalues.iter().zip(held.eigenvectors.column_iter()) {
                if *value > floor {
                    step += direction * (direction.dot(&sum) / value);
                }
            }
            solved.parameters += step;
            if step.amax() < 1e-13 {
                break;
            }
        }
        solved
    }

    /// (R - I) x + s v - R(yaw) u.
    fn residual(&self, motion: &Motion) -> Vector2<f64> {
        let [yaw, x, y, scale] = self.parameters.into();
        turned([x, y], motion.turn) - Vector2::new(x, y) + scale * Vector2::from(motion.vehicle)
            - turned(motion.sensor, yaw)
    }

    fn jacobian(&self, motion: &Motion) -> Matrix2x4<f64> {
        let along = turned(motion.sensor, self.parameters[0]);
        let (sin, cos) = motion.turn.sin_cos();
        Matrix2x4::from_columns(&[
            Vector2::new(along.y, -along.x),
            Vector2::new(cos - 1.0, sin),
            Vector2::new(-sin, cos - 1.0),
            Vector2::from(motion.vehicle),
        ])
    }

    fn median_residual(&self, motions: &[&Motion]) -> f64 {
        let mut lengths: Vec<f64> = motions.iter().map(|motion| self.residual(motion).norm()).collect();
        lengths.sort_by(f64::total_cmp);
        lengths.get(lengths.len() / 2).copied().unwrap_or(0.0)
    }

    fn information(&self, motions: &[&Motion]) -> Matrix4<f64> {
        motions.iter().map(|motion| self.jacobian(motion)).map(|rows| rows.transpose() * rows).sum()
    }

    /// Directions of the parameters of which the motions say too little.
    fn open(&self, motions: &[&Motion]) -> Vec<Vector4<f64>> {
        let parts = SymmetricEigen::new(self.information(motions));
        let weak = parts.eigenvalues.iter().zip(parts.eigenvectors.column_iter());
        weak.filter(|(value, _)| **value <= LEAST_INFORMATION).map(|(_, direction)| direction.into_owned()).collect()
    }

    /// Of what is determined, by the scatter of the gradient from block to block (White 1980; Cameron and Miller 2015).
    fn covariance(&self, motions: &[&Motion], open: &[Vector4<f64>]) -> Matrix4<f64> {
        let mut information = self.information(motions);
        for direction in open {
            information += 1e12 * direction * direction.transpose();
        }
        let Some(inverse) = information.try_inverse() else { return Matrix4::zeros() };
        let length = if motions.len() >= BLOCK * LEAST_BLOCKS { BLOCK } else { 1 };
        let blocks = motions.chunks(length);
        let count = blocks.len() as f64;
        let middle: Matrix4<f64> = blocks
            .map(|block| {
                let gradient: Vector4<f64> =
                    block.iter().map(|motion| self.jacobian(motion).transpose() * self.residual(motion)).sum();
                gradient * gradient.transpose()
            })
            .sum();
        let freedom = count / (count - 2.0).max(1.0);
        inverse * middle * inverse * freedom
    }
}
