//! The displacement that several wheels make, and how it changes with them.

use nalgebra::{Matrix3, Vector3};

use super::wheel_equations::{Solution, derivative, rests, rests_derivative, solve};
use super::{Integration, OdometryNoise, Wheel, WheelMotion, WheelParameter};
use crate::geometry::{Pose, Twist};

/// Shares of the step at which the wheels are asked: start, quarter, middle, end.
const SHARES: [f64; 4] = [0.0, 0.25, 0.5, 1.0];

/// One term of a Runge-Kutta sum: a motion seen under a heading.
struct Term {
    weight: f64,
    /// Which motion is turned, and which heading of another one it is turned by, times what.
    motion: usize,
    turned_by: usize,
    share: f64,
}

const fn term(weight: f64, motion: usize, turned_by: usize, share: f64) -> Term {
    Term { weight, motion, turned_by, share }
}

/// K 5.8: the middle's motion, under the heading that the first half makes.
const SECOND_ORDER: [Term; 1] = [term(1.0, 2, 1, 0.5)];
const FOURTH_ORDER: [Term; 4] =
    [term(1.0 / 6.0, 0, 0, 0.0), term(1.0 / 3.0, 2, 0, 0.5), term(1.0 / 3.0, 2, 2, 0.5), term(1.0 / 6.0, 3, 2, 1.0)];

/// The wheels' motions at several places of their step.
#[derive(Clone, Copy, Debug)]
pub struct WheelPath<'a> {
    wheels: &'a [Wheel],
    motions: &'a [WheelMotion],
    noise: &'a OdometryNoise,
    integration: Integration,
    /// In the order of [`SHARES`]; what an integration does not need is that of the middle.
    solutions: [Solution; 4],
}

impl<'a> WheelPath<'a> {
    /// The path of those wheels. None if they do not determine it.
    #[must_use]
    pub fn new(
        wheels: &'a [Wheel],
        motions: &'a [WheelMotion],
        noise: &'a OdometryNoise,
        integration: Integration,
    ) -> Option<Self> {
        let [start, quarter, middle, end] = SHARES;
        let at = |share: f64| solve(wheels, motions, share, noise);
        let mean = at(middle)?;
        let is_steady = wheels.iter().zip(motions).all(|(wheel, motion)| {
            wheel.steering.is_none() || motion.steering_start.total_cmp(&motion.steering_end).is_eq()
        });
        let solutions = match integration {
            _ if is_steady => [mean; 4],
            Integration::Arc => [mean; 4],
            Integration::RungeKutta2 => [mean, at(quarter)?, mean, mean],
            Integration::RungeKutta4 => [at(start)?, mean, mean, at(end)?],
        };
        Some(Self { wheels, motions, noise, integration, solutions })
    }

    /// The motion in the middle, with what does not fit.
    #[must_use]
    pub const fn middle(&self) -> &Solution {
        let [_, _, middle, _] = &self.solutions;
        middle
    }

    /// Displacement of R, in R at the start.
    #[must_use]
    pub fn displacement(&self) -> Pose {
        let motions = self.solutions.map(|solution| solution.motion);
        match self.terms() {
            None => Pose::exp(&twist(&self.middle().motion)),
            Some(terms) => {
                let sum: Vector3<f64> = terms.iter().map(|term| term.value(&motions)).sum();
                Pose::new(sum.x, sum.y, sum.z)
            }
        }
    }

    /// Derivative of the displacement by a parameter of the wheel of that number; zero if there is no such wheel.
    #[must_use]
    pub fn derivative(&self, wheel: usize, parameter: WheelParameter) -> Vector3<f64> {
        let (Some(which), Some(motion)) = (self.wheels.get(wheel), self.motions.get(wheel)) else {
            return Vector3::zeros();
        };
        let mut changes = [Vector3::zeros(); 4];
        for ((change, solution), share) in changes.iter_mut().zip(&self.solutions).zip(SHARES) {
            *change = derivative(which, motion, share, self.noise, solution, parameter);
        }
        // A motion that stands for another one changes as that one does.
        let [start, quarter, middle, end] = &mut changes;
        match self.integration {
            Integration::Arc => return self.arc_jacobian() * *middle,
            Integration::RungeKutta2 => (*start, *end) = (*middle, *middle),
            Integration::RungeKutta4 => *quarter = *middle,
        }
        let motions = self.solutions.map(|solution| solution.motion);
        let terms = self.terms().unwrap_or(&[]);
        terms.iter().map(|term| term.change(&motions, &changes)).sum()
    }

    /// What does not fit of the wheel of that number, in the middle: of its turn, and across it, m.
    #[must_use]
    pub fn slip(&self, wheel: usize) -> [f64; 2] {
        let (Some(which), Some(motion)) = (self.wheels.get(wheel), self.motions.get(wheel)) else {
            return [0.0; 2];
        };
        rests(which, motion, 0.5, self.noise, self.middle())
    }

    /// Derivative of [`Self::slip`] of a wheel by a parameter of the wheel `by`.
    #[must_use]
    pub fn slip_derivative(&self, wheel: usize, by: usize, parameter: WheelParameter) -> [f64; 2] {
        let wheels = || self.wheels.get(wheel).zip(self.motions.get(wheel));
        let (Some((which, motion)), Some((other, other_motion))) =
            (wheels(), self.wheels.get(by).zip(self.motions.get(by)))
        else {
            return [0.0; 2];
        };
        let solution = self.middle();
        let change = derivative(other, other_motion, 0.5, self.noise, solution, parameter);
        rests_derivative(which, motion, 0.5, self.noise, (solution, &change), (wheel == by).then_some(parameter))
    }

    const fn terms(&self) -> Option<&'static [Term]> {
        match self.integration {
            Integration::Arc => None,
            Integration::RungeKutta2 => Some(&SECOND_ORDER),
            Integration::RungeKutta4 => Some(&FOURTH_ORDER),
        }
    }

    /// Derivative of the displacement of an arc by its motion.
    fn arc_jacobian(&self) -> Matrix3<f64> {
        let motion = &self.middle().motion;
        let unit = |x: f64, y: f64| Pose::exp(&Twist { x, y, theta: motion.z });
        let (first, second) = (unit(1.0, 0.0), unit(0.0, 1.0));
        let (by_x, by_y) = arc_by_rotation(motion);
        Matrix3::new(first.x, second.x, by_x, first.y, second.y, by_y, 0.0, 0.0, 1.0)
    }
}

fn twist(motion: &Vector3<f64>) -> Twist {
    Twist { x: motion.x, y: motion.y, theta: motion.z }
}

/// Below this rotation, rad, series replace quotients.
const SMALL_ROTATION: f64 = 1e-2;

/// Derivative of the end of an arc by its rotation: that of `sin(t)/t` and of `(1 - cos t)/t`.
fn arc_by_rotation(motion: &Vector3<f64>) -> (f64, f64) {
    let turn = motion.z;
    let (along, across) = if libm::fabs(turn) < SMALL_ROTATION {
        let square = turn * turn;
        (
            turn * (-1.0 / 3.0 + square * (1.0 / 30.0 - square / 840.0)),
            0.5 - square * (1.0 / 8.0 - square * (1.0 / 144.0 - square / 5760.0)),
        )
    } else {
        let (sine, cosine) = libm::sincos(turn);
        ((turn * cosine - sine) / (turn * turn), (turn * sine - (1.0 - cosine)) / (turn * turn))
    };
    (along * motion.x - across * motion.y, across * motion.x + along * motion.y)
}

fn turned(angle: f64, motion: &Vector3<f64>) -> Vector3<f64> {
    let (sine, cosine) = libm::sincos(angle);
    Vector3::new(cosine * motion.x - sine * motion.y, sine * motion.x + cosine * motion.y, motion.z)
}

impl Term {
    fn of<'m>(&self, motions: &'m [Vector3<f64>; 4]) -> Option<(&'m Vector3<f64>, &'m Vector3<f64>)> {
        motions.get(self.motion).zip(motions.get(self.turned_by))
    }

    fn value(&self, motions: &[Vector3<f64>; 4]) -> Vector3<f64> {
        self.of(motions).map_or_else(Vector3::zeros, |(motion, by)| self.weight * turned(self.share * by.z, motion))
    }

    fn change(&self, motions: &[Vector3<f64>; 4], changes: &[Vector3<f64>; 4]) -> Vector3<f64> {
        let (Some((motion, by)), Some((change, change_by))) = (self.of(motions), self.of(changes)) else {
            return Vector3::zeros();
        };
        let angle = self.share * by.z;
        let across = turned(angle, &Vector3::new(-motion.y, motion.x, 0.0));
        self.weight * (turned(angle, change) + self.share * change_by.z * across)
    }
}
