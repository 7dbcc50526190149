//! What several wheels say of the motion of a rigid vehicle, in least squares.

use nalgebra::{Matrix3, Vector3};

use super::{Contact, OdometryNoise, Wheel, WheelMotion, WheelParameter};

/// One linear equation of the vehicle's motion: `row * motion = distance`.
#[derive(Clone, Copy, Debug)]
struct Equation {
    /// Direction along which the wheel's contact tells the motion: x, y, and its moment about R, m.
    row: Vector3<f64>,
    /// How far the contact has moved along it, m.
    distance: f64,
    /// One over the square of its slip, m for a square root of a metre.
    weight: f64,
}

/// Slips that are stated as less than this, m for a square root of a metre, are taken as this.
const LEAST_SLIP: f64 = 1e-6;

/// Wheels whose normal equations have a smaller determinant than this share of the product of their diagonal, the most that it
/// can be, do not determine the motion.
const LEAST_DETERMINANT: f64 = 1e-12;

fn weight(slip: f64) -> f64 {
    let slip = libm::fmax(slip, LEAST_SLIP);
    1.0 / (slip * slip)
}

/// Direction `angle`, and its moment about R at the wheel's place.
fn direction(wheel: &Wheel, angle: f64) -> Vector3<f64> {
    let (sine, cosine) = libm::sincos(angle);
    Vector3::new(cosine, sine, wheel.x * sine - wheel.y * cosine)
}

const QUARTER: f64 = core::f64::consts::FRAC_PI_2;

/// Angle of the rollers; a tyre has the direction of its wheel.
fn roller(wheel: &Wheel) -> f64 {
    match wheel.contact {
        Contact::Tyre => 0.0,
        Contact::Rollers(angle) => angle,
    }
}

/// What the turn of the wheel says, if it is measured. `steering` as the encoder says it, rad.
fn rolling(wheel: &Wheel, turn: f64, steering: f64, noise: &OdometryNoise) -> Option<Equation> {
    wheel.turn?;
    let angle = roller(wheel);
    Some(Equation {
        row: direction(wheel, wheel.heading + steering + angle),
        distance: wheel.radius * turn * libm::cos(angle),
        weight: weight(noise.slip),
    })
}

/// That a tyre does not move sideways.
fn sideways(wheel: &Wheel, steering: f64, noise: &OdometryNoise) -> Option<Equation> {
    (wheel.contact == Contact::Tyre).then(|| Equation {
        row: direction(wheel, wheel.heading + steering + QUARTER),
        distance: 0.0,
        weight: weight(noise.side_slip),
    })
}

/// The motion that fits all wheels best, and what does not fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solution {
    /// Motion of R at constant velocity: x and y, m, and rotation, rad.
    pub motion: Vector3<f64>,
    /// Inverse of the normal equations: covariance of the motion for each metre of distance.
    pub spread: Matrix3<f64>,
    /// Squares of what does not fit, each over the square of its slip, m.
    pub misfit: f64,
    /// What does not fit: root of the sum of squares over all wheels, m; negative if the first wheel has told too
    /// little.
    pub slip: f64,
    /// How many more equations there are than unknowns.
    pub redundancy: usize,
}

/// Solves for the motion while the steering is where it was after `share` of the step. None if the wheels do not determine it.
#[must_use]
pub fn solve(wheels: &[Wheel], motions: &[WheelMotion], share: f64, noise: &OdometryNoise) -> Option<Solution> {
    let (mut normal, mut right, mut count) = (Matrix3::zeros(), Vector3::zeros(), 0_usize);
    for equation in equations(wheels, motions, share, noise) {
        normal += equation.weight * equation.row * equation.row.transpose();
        right += equation.weight * equation.distance * equation.row;
        count += 1;
    }
    let product = normal.m11 * normal.m22 * normal.m33;
    // Rounding lets no sum of rows be quite singular.
    if normal.determinant() <= LEAST_DETERMINANT * product || !product.is_finite() {
        return None;
    }
    let spread = normal.try_inverse()?;
    let motion = spread * right;
    let (mut misfit, mut squares) = (0.0, 0.0);
    let mut first = None;
    for equation in equations(wheels, motions, share, noise) {
        let rest = equation.distance - equation.row.dot(&motion);
        first.get_or_insert(rest);
        misfit += equation.weight * rest * rest;
        squares += rest * rest;
    }
    let is_sound = motion.iter().chain(spread.iter()).all(|entry| entry.is_finite());
    let redundancy = count.saturating_sub(3);
    let slip = libm::copysign(libm::sqrt(squares), first.unwrap_or(0.0));
    is_sound.then_some(Solution { motion, spread, misfit, slip, redundancy })
}

fn equations<'a>(
    wheels: &'a [Wheel],
    motions: &'a [WheelMotion],
    share: f64,
    noise: &'a OdometryNoise,
) -> impl Iterator<Item = Equation> + 'a {
    wheels.iter().zip(motions).flat_map(move |(wheel, motion)| {
        let steering = steering_at(wheel, motion, share);
        [rolling(wheel, motion.turn, steering, noise), sideways(wheel, steering, noise)].into_iter().flatten()
    })
}

/// A fixed wheel has no steering angle, whatever is reported.
fn steering_at(wheel: &Wheel, motion: &WheelMotion, share: f64) -> f64 {
    if wheel.steering.is_some() { motion.steering_at(share) } else { 0.0 }
}

/// Derivative of [`Solution::motion`] by a parameter of one of the wheels.
#[must_use]
pub fn derivative(
    wheel: &Wheel,
    motion: &WheelMotion,
    share: f64,
    noise: &OdometryNoise,
    solution: &Solution,
    parameter: WheelParameter,
) -> Vector3<f64> {
    let steering = steering_at(wheel, motion, share);
    let along = wheel.heading + steering + roller(wheel);
    let mut change = Vector3::zeros();
    // Normal equations, differentiated: a row that turns sees what does not fit, and all rows keep their sum.
    let mut add = |equation: Option<Equation>, angle: f64, is_rolling: bool| {
        let Some(equation) = equation else { return };
        let row = row_derivative(wheel, angle, steering, is_rolling, parameter);
        let distance = if is_rolling { distance_derivative(wheel, motion.turn, parameter) } else { 0.0 };
        let rest = equation.distance - equation.row.dot(&solution.motion);
        change += equation.weight * (rest * row + (distance - row.dot(&solution.motion)) * equation.row);
    };
    add(rolling(wheel, motion.turn, steering, noise), along, true);
    add(sideways(wheel, steering, noise), wheel.heading + steering + QUARTER, false);
    solution.spread * change
}

/// What does not fit of a wheel: of its turn, and across it, m; zero for what it does not tell.
#[must_use]
pub fn rests(wheel: &Wheel, motion: &WheelMotion, share: f64, noise: &OdometryNoise, solution: &Solution) -> [f64; 2] {
    let steering = steering_at(wheel, motion, share);
    [rolling(wheel, motion.turn, steering, noise), sideways(wheel, steering, noise)]
        .map(|equation| equation.map_or(0.0, |equation| equation.distance - equation.row.dot(&solution.motion)))
}

/// Derivative of [`rests`] of a wheel while the solution changes by `change`; by a parameter of the same wheel, if one is given.
#[must_use]
pub fn rests_derivative(
    wheel: &Wheel,
    motion: &WheelMotion,
    share: f64,
    noise: &OdometryNoise,
    (solution, change): (&Solution, &Vector3<f64>),
    own: Option<WheelParameter>,
) -> [f64; 2] {
    let steering = steering_at(wheel, motion, share);
    let along = wheel.heading + steering + roller(wheel);
    let of = |equation: Option<Equation>, angle: f64, is_rolling: bool| {
        let Some(equation) = equation else { return 0.0 };
        let by_own = own.map_or(0.0, |parameter| {
            let distance = if is_rolling { distance_derivative(wheel, motion.turn, parameter) } else { 0.0 };
            distance - row_derivative(wheel, angle, steering, is_rolling, parameter).dot(&solution.motion)
        });
        by_own - equation.row.dot(change)
    };
    [
        of(rolling(wheel, motion.turn, steering, noise), along, true),
        of(sideways(wheel, steering, noise), wheel.heading + steering + QUARTER, false),
    ]
}

fn row_derivative(
    wheel: &Wheel,
    angle: f64,
    steering: f64,
    is_rolling: bool,
    parameter: WheelParameter,
) -> Vector3<f64> {
    let turned = || direction(wheel, angle + QUARTER);
    match parameter {
        WheelParameter::X => Vector3::new(0.0, 0.0, libm::sin(angle)),
        WheelParameter::Y => Vector3::new(0.0, 0.0, -libm::cos(angle)),
        WheelParameter::Heading => turned(),
        WheelParameter::SteeringRatio => steering * turned(),
        WheelParameter::Roller if is_rolling && wheel.contact != Contact::Tyre => turned(),
        WheelParameter::Roller | WheelParameter::Radius | WheelParameter::Turn => Vector3::zeros(),
    }
}

fn distance_derivative(wheel: &Wheel, turn: f64, parameter: WheelParameter) -> f64 {
    let (sine, cosine) = libm::sincos(roller(wheel));
    match parameter {
        WheelParameter::Radius => turn * cosine,
        WheelParameter::Turn => wheel.radius * cosine,
        WheelParameter::Roller if wheel.contact != Contact::Tyre => -wheel.radius * turn * sine,
        _ => 0.0,
    }
}
