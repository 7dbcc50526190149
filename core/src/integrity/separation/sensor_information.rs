//! What the landmarks of one event say of the pose of the laser, as information: it can be added, and left out again.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use crate::geometry::{Point, Pose, difference, larger_axis};

/// Below this information, of a metre or of a radian, a direction is not seen.
const LEAST: f64 = 1e-3;

/// Information about where the laser is beside a pose at which the model is linearised: x and y in W, m, and heading, rad.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensorInformation {
    matrix: Matrix3<f64>,
    vector: Vector3<f64>,
    /// Variance of the information's own vector by errors of the map that all landmarks keep for ever.
    by_map: Matrix3<f64>,
    /// Sum of the normalised squares of how far landmarks are from where they should be, and of how many numbers.
    square: f64,
    numbers: f64,
}

/// A landmark that was seen, in the frame of the laser at the time for which the information is.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Where it was seen, m.
    pub position: Point,
    /// Covariance of that, m^2.
    pub covariance: Matrix2<f64>,
    /// Where the map has it in W, m.
    pub landmark: Point,
    /// Variance of that along each axis, m^2.
    pub landmark_variance: f64,
}

/// One number that is told of the pose of the laser: its derivative by the pose, its value and its variance.
pub type Told = (Vector3<f64>, f64, f64);

impl SensorInformation {
    /// Nothing is seen.
    pub const NONE: Self =
        Self { matrix: ZERO, vector: Vector3::new(0.0, 0.0, 0.0), by_map: ZERO, square: 0.0, numbers: 0.0 };

    /// What one landmark says of a laser that is about at `sensor` in W.
    #[must_use]
    pub fn of(seen: &Seen, sensor: &Pose) -> Self {
        let (sine, cosine) = libm::sincos(sensor.theta);
        let turned = Vector2::new(
            cosine * seen.position.x - sine * seen.position.y,
            sine * seen.position.x + cosine * seen.position.y,
        );
        let rotation = Matrix2::new(cosine, -sine, sine, cosine);
        let covariance = rotation * seen.covariance * rotation.transpose();
        let of_landmark = Matrix2::identity() * seen.landmark_variance;
        let Some(weight) = (covariance + of_landmark).try_inverse() else { return Self::NONE };
        let residual = Vector2::new(seen.landmark.x - sensor.x - turned.x, seen.landmark.y - sensor.y - turned.y);
        let by_pose = nalgebra::Matrix2x3::new(1.0, 0.0, -turned.y, 0.0, 1.0, turned.x);
        let weighted = by_pose.transpose() * weight;
        Self {
            matrix: weighted * by_pose,
            vector: weighted * residual,
            by_map: weighted * weighted.transpose() * seen.landmark_variance,
            square: residual.dot(&(weight * residual)),
            numbers: 2.0,
        }
    }

    /// What a whole pose of the laser says of one that is about at `sensor` in W: `covariance` is its own, of x, y (m) and heading
    /// (rad), and `shared` what of it are errors of the map.
    #[must_use]
    pub fn of_pose(pose: &Pose, covariance: &Matrix3<f64>, shared: &[f64; 3], sensor: &Pose) -> Self {
        let Some(matrix) = covariance.try_inverse() else { return Self::NONE };
        let residual = Vector3::new(pose.x - sensor.x, pose.y - sensor.y, difference(pose.theta, sensor.theta));
        let vector = matrix * residual;
        let by_map = matrix * Matrix3::from_diagonal(&Vector3::from(*shared)) * matrix;
        let told = Self { matrix, vector, by_map, square: residual.dot(&vector), numbers: 0.0 };
        // It contradicts itself nowhere.
        Self { numbers: told.told().iter().flatten().count() as f64, ..told }
    }

    /// With more landmarks.
    #[must_use]
    pub fn with(&self, other: &Self) -> Self {
        Self {
            matrix: self.matrix + other.matrix,
            vector: self.vector + other.vector,
            by_map: self.by_map + other.by_map,
            square: self.square + other.square,
            numbers: self.numbers + other.numbers,
        }
    }

    /// Without some of its landmarks.
    #[must_use]
    pub fn without(&self, other: &Self) -> Self {
        Self {
            matrix: self.matrix - other.matrix,
            vector: self.vector - other.vector,
            by_map: self.by_map - other.by_map,
            square: self.square - other.square,
            numbers: self.numbers - other.numbers,
        }
    }

    /// Whether it says anything.
    #[must_use]
    pub fn is_any(&self) -> bool {
        self.matrix.trace() > LEAST
    }

    /// How badly the landmarks fit each other, wherever the laser is: the normalised square that the best pose leaves, and
    /// its degrees of freedom.
    #[must_use]
    pub fn misfit(&self) -> (f64, f64) {
        let told = self.told();
        let explained = told.iter().flatten().fold(0.0, |sum, (_, value, variance)| sum + value * value / variance);
        (not_negative(self.square - explained), (self.numbers - told.iter().flatten().count() as f64).max(0.0))
    }

    /// Mean variance of a number that a landmark tells, m^2, and mean square of the distance to landmarks, m^2; none if
    /// nothing is seen.
    #[must_use]
    pub fn means(&self) -> Option<(f64, f64)> {
        let weight = self.matrix.m11 + self.matrix.m22;
        self.is_any().then(|| (self.numbers / weight, 2.0 * self.matrix.m33 / weight))
    }

    /// Variances of the position's larger axis, m^2, and of the heading, rad^2, that the errors of the map alone make of a
    /// pose found from this alone; none if its position's larger axis has more than the variance `most`, m^2.
    #[must_use]
    pub fn map_variances(&self, most: f64) -> Option<(f64, f64)> {
        let [_, _, Some(_)] = self.told() else { return None };
        let inverse = self.matrix.try_inverse()?;
        if !(0.0..=most).contains(&larger_axis(inverse.m11, inverse.m12, inverse.m22)) {
            return None;
        }
        let covariance = inverse * self.by_map * inverse;
        Some((not_negative(larger_axis(covariance.m11, covariance.m12, covariance.m22)), covariance.m33.max(0.0)))
    }

    /// The same as up to three numbers with independent errors: the rows of L' of the matrix L D L'.
    #[must_use]
    pub fn told(&self) -> [Option<Told>; 3] {
        let Matrix3Parts { m11, m12, m13, m22, m23, m33 } = Matrix3Parts::of(&self.matrix);
        let quotient = |number: f64, by: f64| if by > LEAST { number / by } else { 0.0 };
        let (l21, l31) = (quotient(m12, m11), quotient(m13, m11));
        let d2 = m22 - l21 * m12;
        let l32 = quotient(m23 - l31 * m12, d2);
        let d3 = m33 - l31 * m13 - l32 * (m23 - l31 * m12);
        let first = self.vector.x;
        let second = self.vector.y - l21 * first;
        let third = self.vector.z - l31 * first - l32 * second;
        let one = |row: Vector3<f64>, value: f64, information: f64| {
            (information > LEAST).then(|| (row, value / information, 1.0 / information))
        };
        [
            one(Vector3::new(1.0, l21, l31), first, m11),
            one(Vector3::new(0.0, 1.0, l32), second, d2),
            one(Vector3::new(0.0, 0.0, 1.0), third, d3),
        ]
    }
}

const ZERO: Matrix3<f64> = Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);

/// What rounding has made negative is zero; what is not a number stays so.
#[must_use]
pub fn not_negative(variance: f64) -> f64 {
    if variance < 0.0 { 0.0 } else { variance }
}

struct Matrix3Parts {
    m11: f64,
    m12: f64,
    m13: f64,
    m22: f64,
    m23: f64,
    m33: f64,
}

impl Matrix3Parts {
    fn of(matrix: &Matrix3<f64>) -> Self {
        Self { m11: matrix.m11, m12: matrix.m12, m13: matrix.m13, m22: matrix.m22, m23: matrix.m23, m33: matrix.m33 }
    }
}
