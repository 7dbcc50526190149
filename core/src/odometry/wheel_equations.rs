//! What several wheels say of the motion of a rigid vehicle, in least squares.

use nalgebra::{Matrix3, Vector3};

use super::wheel_set::{RollingWheel, WheelSet};
use super::{Contact, OdometryNoise, Wheel, WheelMotion, WheelParameter};
use crate::measurement::MOST_WHEELS;

/// Slips that are stated as less than this, m for a square root of a metre, are taken as this.
pub(super) const LEAST_SLIP: f64 = 1e-6;

/// Wheels whose normal equations have a smaller determinant than this share of the product of their diagonal, the most that it
/// can be, do not determine the motion.
const LEAST_DETERMINANT: f64 = 1e-12;

/// How much the equations weigh: one over the squares of their slips, 1/m.
#[derive(Clone, Copy, Debug)]
pub struct Weights {
    rolling: f64,
    sideways: f64,
}

impl Weights {
    pub fn of(noise: &OdometryNoise) -> Self {
        let weight = |slip: f64| {
            let slip = slip.max(LEAST_SLIP);
            1.0 / (slip * slip)
        };
        Self { rolling: weight(noise.slip), sideways: weight(noise.side_slip) }
    }
}

/// The linear equations of the vehicle's motion (x, y, rotation) that one wheel tells at one place of the step.
struct WheelEquations {
    /// `along * motion = distance` if its turn is measured: the direction in which its turn tells the motion, and the direction's
    /// moment about R, m.
    along: Vector3<f64>,
    /// `across * motion = 0` of a tyre: [`Self::along`] a quarter further to the left, which is its derivative by the angle, too.
    across: Vector3<f64>,
    /// How far the contact has moved along it, m.
    distance: f64,
}

impl WheelEquations {
    /// Of a wheel that has turned by `turn` (rad), in that direction (sine and cosine).
    fn new(rolling: &RollingWheel, turn: f64, (sine, cosine): (f64, f64)) -> Self {
        let Wheel { x, y, .. } = rolling.wheel;
        Self {
            along: Vector3::new(cosine, sine, x * sine - y * cosine),
            across: Vector3::new(-sine, cosine, x * cosine + y * sine),
            distance: rolling.way * turn,
        }
    }

    /// What does not fit that motion, of its turn and across it, m; None of what it does not tell.
    fn rests(&self, rolling: &RollingWheel, motion: &Vector3<f64>) -> [Option<f64>; 2] {
        [
            rolling.is_measured().then(|| self.distance - self.along.dot(motion)),
            rolling.is_tyre().then(|| -self.across.dot(motion)),
        ]
    }

    /// Derivatives of both rows by a parameter of the wheel, while its steering encoder says `steering`, rad.
    fn rows_by(&self, rolling: &RollingWheel, steering: f64, parameter: WheelParameter) -> [Vector3<f64>; 2] {
        let moment = |value: f64| Vector3::new(0.0, 0.0, value);
        match parameter {
            WheelParameter::X => [moment(self.along.y), moment(self.across.y)],
            WheelParameter::Y => [moment(-self.along.x), moment(-self.across.x)],
            WheelParameter::Heading => [self.across, -self.along],
            WheelParameter::SteeringRatio => [self.across * steering, self.along * -steering],
            WheelParameter::Roller if !rolling.is_tyre() => [self.across, Vector3::zeros()],
            WheelParameter::Roller | WheelParameter::Radius | WheelParameter::Turn => [Vector3::zeros(); 2],
        }
    }
}

/// Derivative of how far a wheel's contact has moved along its direction.
fn distance_by(rolling: &RollingWheel, turn: f64, parameter: WheelParameter) -> f64 {
    match (parameter, rolling.wheel.contact) {
        (WheelParameter::Radius, Contact::Tyre) => turn,
        (WheelParameter::Radius, Contact::Rollers(angle)) => turn * libm::cos(angle),
        (WheelParameter::Turn, _) => rolling.way,
        (WheelParameter::Roller, Contact::Rollers(angle)) => -rolling.wheel.radius * turn * libm::sin(angle),
        _ => 0.0,
    }
}

/// How well the wheels fit the motion that fits them best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelFit {
    /// Squares of what does not fit, each over the square of its slip, m.
    pub misfit: f64,
    /// What does not fit: root of the sum of squares over all wheels, m; negative if the first wheel has told too
    /// little.
    pub slip: f64,
    /// How many more equations there are than unknowns.
    pub redundancy: usize,
}

/// What the wheels say while their steering is where it was after some share of the step.
#[derive(Clone, Copy, Debug)]
pub struct SolvedWheels {
    /// Motion of R at constant velocity that fits best: x and y, m, and rotation, rad.
    pub motion: Vector3<f64>,
    /// Inverse of the normal equations: covariance of the motion for each metre of distance.
    pub spread: Symmetric,
    /// Sine and cosine of where the wheels point.
    directions: [(f64, f64); MOST_WHEELS],
}

impl SolvedWheels {
    /// Before they are solved.
    pub const UNSOLVED: Self =
        Self { motion: Vector3::new(0.0, 0.0, 0.0), spread: Symmetric::ZERO, directions: [(0.0, 0.0); MOST_WHEELS] };

    /// Solves for the motion, in place as the whole is large. None if the wheels do not determine it.
    pub fn solve(&mut self, set: &WheelSet, motions: &[WheelMotion], share: f64, weights: &Weights) -> Option<()> {
        let (mut normal, mut right) = (Symmetric::ZERO, Vector3::zeros());
        for ((direction, rolling), motion) in self.directions.iter_mut().zip(set.wheels()).zip(motions) {
            *direction = rolling.direction(motion.steering_at(share));
            let equations = WheelEquations::new(rolling, motion.turn, *direction);
            if rolling.is_measured() {
                normal.add(&equations.along, weights.rolling);
                right += equations.along * (weights.rolling * equations.distance);
            }
            if rolling.is_tyre() {
                normal.add(&equations.across, weights.sideways);
            }
        }
        self.spread = normal.inverse()?;
        self.motion = self.spread.times(&right);
        let is_sound = self.motion.iter().all(|entry| entry.is_finite()) && self.spread.is_finite();
        is_sound.then_some(())
    }

    /// How well the wheels fit the motion.
    pub fn fit(&self, set: &WheelSet, motions: &[WheelMotion], weights: &Weights) -> WheelFit {
        let (mut misfit, mut squares, mut first, mut count) = (0.0, 0.0, None, 0_usize);
        for ((direction, rolling), motion) in self.directions.iter().zip(set.wheels()).zip(motions) {
            let equations = WheelEquations::new(rolling, motion.turn, *direction);
            let weights = [weights.rolling, weights.sideways];
            for (rest, weight) in equations.rests(rolling, &self.motion).into_iter().zip(weights) {
                let Some(rest) = rest else { continue };
                first.get_or_insert(rest);
                misfit += weight * rest * rest;
                squares += rest * rest;
                count += 1;
            }
        }
        let slip = libm::copysign(libm::sqrt(squares), first.unwrap_or(0.0));
        WheelFit { misfit, slip, redundancy: count.saturating_sub(3) }
    }

    /// Derivative of [`Self::motion`] by a parameter of a wheel.
    pub fn derivative(&self, of: &Moved, weights: &Weights, parameter: WheelParameter) -> Vector3<f64> {
        let Some((rolling, equations)) = self.equations(of) else { return Vector3::zeros() };
        let [along, across] = equations.rows_by(rolling, of.steering, parameter);
        let mut change = Vector3::zeros();
        // Normal equations, differentiated: a row that turns sees what does not fit, and all rows keep their sum.
        let [rolling_rest, sideways_rest] = equations.rests(rolling, &self.motion);
        if let Some(rest) = rolling_rest {
            let fit = distance_by(rolling, of.turn, parameter) - along.dot(&self.motion);
            change += (along * rest + equations.along * fit) * weights.rolling;
        }
        if let Some(rest) = sideways_rest {
            change += (across * rest - equations.across * across.dot(&self.motion)) * weights.sideways;
        }
        self.spread.times(&change)
    }

    /// What does not fit of a wheel: of its turn, and across it, m; zero for what it does not tell.
    pub fn rests(&self, of: &Moved) -> [f64; 2] {
        let Some((rolling, equations)) = self.equations(of) else { return [0.0; 2] };
        equations.rests(rolling, &self.motion).map(|rest| rest.unwrap_or(0.0))
    }

    /// Derivative of [`Self::rests`] while the motion changes by `change`; by a parameter of the same wheel, if one is given.
    pub fn rests_derivative(&self, of: &Moved, change: &Vector3<f64>, own: Option<WheelParameter>) -> [f64; 2] {
        let Some((rolling, equations)) = self.equations(of) else { return [0.0; 2] };
        let [along, across] = own.map_or([0.0; 2], |parameter| {
            let [along, across] = equations.rows_by(rolling, of.steering, parameter);
            [distance_by(rolling, of.turn, parameter) - along.dot(&self.motion), -across.dot(&self.motion)]
        });
        [
            if rolling.is_measured() { along - equations.along.dot(change) } else { 0.0 },
            if rolling.is_tyre() { across - equations.across.dot(change) } else { 0.0 },
        ]
    }

    fn equations<'a>(&self, of: &Moved<'a>) -> Option<(&'a RollingWheel, WheelEquations)> {
        let direction = self.directions.get(of.number)?;
        Some((of.wheel, WheelEquations::new(of.wheel, of.turn, *direction)))
    }
}

/// One of the wheels, and how it has moved where it is looked at.
pub struct Moved<'a> {
    pub wheel: &'a RollingWheel,
    /// Its place among the wheels.
    pub number: usize,
    /// How far it has turned in the whole step, rad.
    pub turn: f64,
    /// What its steering encoder says, rad.
    pub steering: f64,
}

/// A symmetric matrix.
#[derive(Clone, Copy, Debug)]
pub struct Symmetric {
    xx: f64,
    xy: f64,
    xz: f64,
    yy: f64,
    yz: f64,
    zz: f64,
}

impl Symmetric {
    const ZERO: Self = Self { xx: 0.0, xy: 0.0, xz: 0.0, yy: 0.0, yz: 0.0, zz: 0.0 };

    /// Adds `row' row`, times a weight.
    fn add(&mut self, row: &Vector3<f64>, weight: f64) {
        let [x, y, z] = [row.x * weight, row.y * weight, row.z * weight];
        self.xx += x * row.x;
        self.xy += x * row.y;
        self.xz += x * row.z;
        self.yy += y * row.y;
        self.yz += y * row.z;
        self.zz += z * row.z;
    }

    /// None if it is singular, but for rounding, which lets no sum of rows be quite singular.
    fn inverse(&self) -> Option<Self> {
        let Self { xx, xy, xz, yy, yz, zz } = *self;
        let (by_xx, by_xy, by_xz) = (yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy);
        let determinant = xx * by_xx + xy * by_xy + xz * by_xz;
        let largest = xx * yy * zz;
        if determinant <= LEAST_DETERMINANT * largest || !largest.is_finite() {
            return None;
        }
        let scale = 1.0 / determinant;
        Some(Self {
            xx: by_xx * scale,
            xy: by_xy * scale,
            xz: by_xz * scale,
            yy: (xx * zz - xz * xz) * scale,
            yz: (xy * xz - xx * yz) * scale,
            zz: (xx * yy - xy * xy) * scale,
        })
    }

    fn times(&self, vector: &Vector3<f64>) -> Vector3<f64> {
        let Self { xx, xy, xz, yy, yz, zz } = self;
        let (x, y, z) = (vector.x, vector.y, vector.z);
        Vector3::new(xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z)
    }

    fn is_finite(&self) -> bool {
        [self.xx, self.xy, self.xz, self.yy, self.yz, self.zz].into_iter().all(f64::is_finite)
    }

    /// As a whole matrix.
    pub fn matrix(&self) -> Matrix3<f64> {
        let Self { xx, xy, xz, yy, yz, zz } = *self;
        Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
    }
}
