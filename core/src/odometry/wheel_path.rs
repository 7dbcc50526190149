//! The displacement that several wheels make, and how it changes with them.

use nalgebra::{Matrix3, Vector3};

use super::wheel_equations::{Moved, SolvedWheels, Weights, WheelFit};
use super::{Integration, OdometryNoise, WheelMotion, WheelParameter, WheelSet};
use crate::geometry::{Pose, Twist};

/// Where in its step the wheels are asked.
#[derive(Clone, Copy)]
enum Place {
    /// See [`WheelPath::before`].
    Before,
    Middle,
    End,
}

impl Place {
    /// After which share of the step it is.
    const fn share(self, integration: Integration) -> f64 {
        match (self, integration) {
            (Self::Before, Integration::RungeKutta4) => 0.0,
            (Self::Before, Integration::RungeKutta2 | Integration::Arc) => 0.25,
            (Self::Middle, _) => 0.5,
            (Self::End, _) => 1.0,
        }
    }
}

/// Motions, or what they change by, at each [`Place`].
struct Places {
    before: Vector3<f64>,
    middle: Vector3<f64>,
    end: Vector3<f64>,
}

impl Places {
    const fn at(&self, place: Place) -> &Vector3<f64> {
        match place {
            Place::Before => &self.before,
            Place::Middle => &self.middle,
            Place::End => &self.end,
        }
    }
}

/// One term of a Runge-Kutta sum: a motion seen under a heading.
struct Term {
    weight: f64,
    /// Which motion is turned, and which heading of another one it is turned by, times what.
    motion: Place,
    turned_by: Place,
    share: f64,
}

const MOST_TERMS: usize = 4;

const fn term(weight: f64, motion: Place, turned_by: Place, share: f64) -> Term {
    Term { weight, motion, turned_by, share }
}

/// K 5.8: the middle's motion, under the heading that the first half makes.
const SECOND_ORDER: [Term; 1] = [term(1.0, Place::Middle, Place::Before, 0.5)];
const FOURTH_ORDER: [Term; MOST_TERMS] = [
    term(1.0 / 6.0, Place::Before, Place::Before, 0.0),
    term(1.0 / 3.0, Place::Middle, Place::Before, 0.5),
    term(1.0 / 3.0, Place::Middle, Place::Middle, 0.5),
    term(1.0 / 6.0, Place::End, Place::Middle, 1.0),
];

/// The wheels' motions at several places of their step.
#[derive(Clone, Copy, Debug)]
pub struct WheelPath<'a> {
    set: &'a WheelSet,
    motions: &'a [WheelMotion],
    weights: Weights,
    integration: Integration,
    middle: SolvedWheels,
    /// After a quarter of a second-order step, at the start of a fourth-order one; none if it is as the middle is.
    before: Option<SolvedWheels>,
    /// At the end of a fourth-order step; none if it is as the middle is.
    end: Option<SolvedWheels>,
    /// Sine and cosine of the heading under which each term is seen.
    headings: [(f64, f64); MOST_TERMS],
}

impl<'a> WheelPath<'a> {
    /// The path of those wheels. None if they do not determine it.
    #[must_use]
    pub fn new(
        set: &'a WheelSet,
        motions: &'a [WheelMotion],
        noise: &OdometryNoise,
        integration: Integration,
    ) -> Option<Self> {
        let mut path = Self::unsolved(set, motions, noise, integration);
        path.solve()?;
        Some(path)
    }

    /// Before it is solved.
    pub(super) fn unsolved(
        set: &'a WheelSet,
        motions: &'a [WheelMotion],
        noise: &OdometryNoise,
        integration: Integration,
    ) -> Self {
        let (weights, middle) = (Weights::of(noise), SolvedWheels::UNSOLVED);
        let headings = [(0.0, 1.0); MOST_TERMS];
        Self { set, motions, weights, integration, middle, before: None, end: None, headings }
    }

    /// Solves in place: copies of the whole were a fifth of a prediction's instructions. None if the wheels do not determine it.
    pub(super) fn solve(&mut self) -> Option<()> {
        let Self { set, motions, weights, integration, .. } = *self;
        self.middle.solve(set, motions, Place::Middle.share(integration), &weights)?;
        let is_steady = set.wheels().iter().zip(motions).all(|(rolling, motion)| {
            rolling.wheel.steering.is_none() || motion.steering_start.total_cmp(&motion.steering_end).is_eq()
        });
        if !is_steady && integration != Integration::Arc {
            let before = self.before.insert(SolvedWheels::UNSOLVED);
            before.solve(set, motions, Place::Before.share(integration), &weights)?;
        }
        if !is_steady && integration == Integration::RungeKutta4 {
            let end = self.end.insert(SolvedWheels::UNSOLVED);
            end.solve(set, motions, Place::End.share(integration), &weights)?;
        }
        let motions = self.at_places(|solved, _| solved.motion);
        for (heading, term) in self.headings.iter_mut().zip(self.integration.terms().unwrap_or_default()) {
            *heading = libm::sincos(term.share * motions.at(term.turned_by).z);
        }
        Some(())
    }

    /// Motion of R in the middle at constant velocity: x and y, m, and rotation, rad.
    #[must_use]
    pub const fn middle(&self) -> &Vector3<f64> {
        &self.middle.motion
    }

    /// Covariance of the motion in the middle for each metre of distance, from the slip of every wheel.
    #[must_use]
    pub fn spread(&self) -> Matrix3<f64> {
        self.middle.spread.matrix()
    }

    /// How well the wheels fit each other in the middle.
    #[must_use]
    pub fn fit(&self) -> WheelFit {
        self.middle.fit(self.set, self.motions, &self.weights)
    }

    fn at_places(&self, of: impl Fn(&SolvedWheels, Place) -> Vector3<f64>) -> Places {
        let middle = of(&self.middle, Place::Middle);
        let at = |solved: &Option<SolvedWheels>, place| solved.as_ref().map_or(middle, |solved| of(solved, place));
        Places { middle, before: at(&self.before, Place::Before), end: at(&self.end, Place::End) }
    }

    /// The wheel of that number, there.
    fn moved(&self, number: usize, place: Place) -> Option<Moved<'_>> {
        let (wheel, motion) = self.set.get(number).zip(self.motions.get(number))?;
        // A fixed wheel has no steering angle, whatever is reported.
        let is_steered = wheel.wheel.steering.is_some();
        let steering = if is_steered { motion.steering_at(place.share(self.integration)) } else { 0.0 };
        Some(Moved { wheel, number, turn: motion.turn, steering })
    }

    /// Displacement of R, in R at the start.
    #[must_use]
    pub fn displacement(&self) -> Pose {
        let Some(terms) = self.integration.terms() else { return Pose::exp(&twist(self.middle())) };
        let motions = self.at_places(|solved, _| solved.motion);
        let sum: Vector3<f64> = terms.iter().zip(&self.headings).map(|(term, by)| term.value(*by, &motions)).sum();
        Pose::new(sum.x, sum.y, sum.z)
    }

    /// Derivative of the displacement by a parameter of the wheel of that number; zero if there is no such wheel.
    #[must_use]
    pub fn derivative(&self, wheel: usize, parameter: WheelParameter) -> Vector3<f64> {
        let change = |solved: &SolvedWheels, place: Place| {
            let moved = self.moved(wheel, place);
            moved.map_or_else(Vector3::zeros, |moved| solved.derivative(&moved, &self.weights, parameter))
        };
        let Some(terms) = self.integration.terms() else {
            return self.arc_jacobian() * change(&self.middle, Place::Middle);
        };
        let motions = self.at_places(|solved, _| solved.motion);
        let changes = self.at_places(change);
        terms.iter().zip(&self.headings).map(|(term, by)| term.change(*by, &motions, &changes)).sum()
    }

    /// What does not fit of the wheel of that number, in the middle: of its turn, and across it, m.
    #[must_use]
    pub fn slip(&self, wheel: usize) -> [f64; 2] {
        self.moved(wheel, Place::Middle).map_or([0.0; 2], |moved| self.middle.rests(&moved))
    }

    /// Derivative of [`Self::slip`] of a wheel by a parameter of the wheel `by`.
    #[must_use]
    pub fn slip_derivative(&self, wheel: usize, by: usize, parameter: WheelParameter) -> [f64; 2] {
        let moved = |number| self.moved(number, Place::Middle);
        let Some((moved, other)) = moved(wheel).zip(moved(by)) else { return [0.0; 2] };
        let change = self.middle.derivative(&other, &self.weights, parameter);
        self.middle.rests_derivative(&moved, &change, (wheel == by).then_some(parameter))
    }

    /// Derivative of the displacement of an arc by its motion.
    fn arc_jacobian(&self) -> Matrix3<f64> {
        let motion = self.middle();
        let unit = |x: f64, y: f64| Pose::exp(&Twist { x, y, theta: motion.z });
        let (first, second) = (unit(1.0, 0.0), unit(0.0, 1.0));
        let (by_x, by_y) = arc_by_rotation(motion);
        Matrix3::new(first.x, second.x, by_x, first.y, second.y, by_y, 0.0, 0.0, 1.0)
    }
}

impl Integration {
    /// The terms of its sum; none of an arc.
    const fn terms(self) -> Option<&'static [Term]> {
        match self {
            Self::Arc => None,
            Self::RungeKutta2 => Some(&SECOND_ORDER),
            Self::RungeKutta4 => Some(&FOURTH_ORDER),
        }
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

fn turned((sine, cosine): (f64, f64), motion: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(cosine * motion.x - sine * motion.y, sine * motion.x + cosine * motion.y, motion.z)
}

impl Term {
    /// `heading` is the sine and cosine of what it is seen under.
    fn value(&self, heading: (f64, f64), motions: &Places) -> Vector3<f64> {
        self.weight * turned(heading, motions.at(self.motion))
    }

    fn change(&self, heading: (f64, f64), motions: &Places, changes: &Places) -> Vector3<f64> {
        let motion = motions.at(self.motion);
        let turn = self.share * changes.at(self.turned_by).z;
        let across = Vector3::new(-motion.y, motion.x, 0.0);
        self.weight * turned(heading, &(changes.at(self.motion) + across * turn))
    }
}
