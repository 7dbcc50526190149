//! What a fit may change, and how uncertain that is before.

use agv_core::geometry::Pose;
use agv_core::odometry::{Contact, Wheel, WheelParameter};

/// A vehicle with something on it whose poses are known.
#[derive(Clone, Debug, PartialEq)]
pub struct WheeledModel {
    /// The wheels. The scale of a steering encoder is the ratio of the true angle to the one that a drive states.
    pub wheels: Vec<Wheel>,
    /// Pose in R of what the poses are of.
    pub sensor: Pose,
}

/// What an unknown moves: parameters of wheels, each with its factor, or a coordinate of the sensor.
#[derive(Clone, Debug, PartialEq)]
pub enum Moves {
    /// Number of the wheel, parameter, factor.
    Wheels(Vec<(usize, WheelParameter, f64)>),
    /// Coordinate of the sensor's pose in R: x, y, heading.
    Sensor(usize),
}

/// One number that a fit may change.
#[derive(Clone, Debug, PartialEq)]
pub struct Unknown {
    /// Its name with its unit.
    pub name: String,
    /// What it moves.
    pub moves: Moves,
    /// Standard deviation of what was believed before, in its unit.
    pub prior: f64,
}

/// Believed before: share of a radius, of a distance between wheels, of a steering ratio.
const SHARE: f64 = 0.3;
const RATIO: f64 = 0.15;
/// Steering offset, rad; mounting angle of a wheel or its rollers, rad.
const OFFSET: f64 = 0.3;
const MOUNTING: f64 = 0.15;
/// Place, m, and heading, rad, of the sensor.
const SENSOR: f64 = 0.1;

/// The kinematics that a fit knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Steered and driven wheel, rear axle.
    Tricycle,
    /// Left and right wheel.
    Differential,
    /// Front and rear wheel, both steered and driven.
    BiSteerable,
    /// Rear left, rear right, and steered front wheel.
    Ackermann,
    /// Omnidirectional or mecanum wheels, all measured.
    Omnidirectional,
}

impl Unknown {
    fn wheel(name: String, moves: Vec<(usize, WheelParameter, f64)>, prior: f64) -> Self {
        Self { name, moves: Moves::Wheels(moves), prior }
    }

    /// What is unknown of a vehicle of that kind whose nominal wheels are given; of the sensor if it is not held.
    #[must_use]
    pub fn of(kind: Kind, wheels: &[Wheel], is_sensor_free: bool) -> Vec<Self> {
        let measured = wheels.iter().enumerate().filter(|(_, wheel)| wheel.turn.is_some());
        let radius = |(number, wheel): (usize, &Wheel)| {
            let way = vec![(number, WheelParameter::Radius, 1.0)];
            Self::wheel(format!("radius of wheel {} m", number + 1), way, SHARE * wheel.radius.abs())
        };
        let mut unknowns: Vec<Self> = measured.map(radius).collect();
        for (number, _) in wheels.iter().enumerate().filter(|(_, wheel)| wheel.steering.is_some()) {
            let offset = vec![(number, WheelParameter::Heading, 1.0)];
            let ratio = vec![(number, WheelParameter::SteeringRatio, 1.0)];
            unknowns.push(Self::wheel(format!("steering offset of wheel {} rad", number + 1), offset, OFFSET));
            unknowns.push(Self::wheel(format!("steering ratio of wheel {} less one", number + 1), ratio, RATIO));
        }
        unknowns.extend(Self::geometry(kind, wheels));
        let sensor =
            |(axis, name): (usize, &str)| Self { name: name.to_owned(), moves: Moves::Sensor(axis), prior: SENSOR };
        let names = ["sensor x m", "sensor y m", "sensor heading rad"];
        unknowns.extend(names.into_iter().enumerate().filter(|_| is_sensor_free).map(sensor));
        unknowns
    }

    /// The same numbers with one of all radii, which stay as many times each other, instead of those of each wheel.
    #[must_use]
    pub fn with_common_radius(unknowns: &[Self], wheels: &[Wheel]) -> Vec<Self> {
        let is_radius = |unknown: &&Self| match &unknown.moves {
            Moves::Wheels(moves) => moves.iter().all(|(_, parameter, _)| *parameter == WheelParameter::Radius),
            Moves::Sensor(_) => false,
        };
        let measured = || wheels.iter().enumerate().filter(|(_, wheel)| wheel.turn.is_some());
        let Some((_, first)) = measured().next() else { return unknowns.to_vec() };
        let moves = measured().map(|(number, wheel)| (number, WheelParameter::Radius, wheel.radius / first.radius));
        let common = Self::wheel("radius of all wheels m".to_owned(), moves.collect(), SHARE * first.radius.abs());
        std::iter::once(common).chain(unknowns.iter().filter(|unknown| !is_radius(unknown)).cloned()).collect()
    }

    fn geometry(kind: Kind, wheels: &[Wheel]) -> Vec<Self> {
        use WheelParameter::{X, Y};
        let away = |wheel: usize| wheels.get(wheel).map_or(0.0, |wheel| wheel.x.hypot(wheel.y));
        let half = |wheel: usize| wheels.get(wheel).map_or(0.5, |wheel| 0.5_f64.copysign(wheel.y));
        let track = || Self::wheel("track m".to_owned(), vec![(0, Y, half(0)), (1, Y, half(1))], SHARE * 2.0 * away(0));
        let base = |wheel: usize| Self::wheel("wheelbase m".to_owned(), vec![(wheel, X, 1.0)], SHARE * away(wheel));
        match kind {
            Kind::Tricycle => vec![base(0)],
            Kind::Differential => vec![track()],
            Kind::BiSteerable => {
                let distance = away(0) + away(1);
                vec![Self::wheel("wheelbase m".to_owned(), vec![(0, X, 0.5), (1, X, -0.5)], SHARE * distance)]
            }
            Kind::Ackermann => vec![track(), base(2)],
            Kind::Omnidirectional => {
                let outward = |(number, wheel): (usize, &Wheel)| {
                    [(number, X, wheel.x / away(number)), (number, Y, wheel.y / away(number))]
                };
                let arms = wheels.iter().enumerate().flat_map(outward).collect();
                let mut unknowns = vec![Self::wheel("arm m".to_owned(), arms, SHARE * away(0))];
                unknowns.extend(Self::directions(wheels));
                unknowns
            }
        }
    }

    /// Directions in which omnidirectional wheels measure. As R may lie anywhere, what moves all of them alike is none: with rollers
    /// across, those of all wheels but the first; with four mecanum wheels, three directions of motion tell one angle of all rollers.
    fn directions(wheels: &[Wheel]) -> Vec<Self> {
        let rollers = wheels.iter().enumerate().filter_map(|(number, wheel)| match wheel.contact {
            Contact::Rollers(angle) if angle != 0.0 => Some((number, WheelParameter::Roller, angle.signum())),
            _ => None,
        });
        let rollers: Vec<_> = rollers.collect();
        if !rollers.is_empty() {
            return vec![Self::wheel("rollers rad".to_owned(), rollers, MOUNTING)];
        }
        let direction = |number: usize| {
            let name = format!("direction of wheel {} rad", number + 1);
            Self::wheel(name, vec![(number, WheelParameter::Heading, 1.0)], MOUNTING)
        };
        (1..wheels.len().min(3)).map(direction).collect()
    }
}

impl WheeledModel {
    /// The model with each unknown changed by the value of the same place, in its unit.
    #[must_use]
    pub fn changed(&self, unknowns: &[Unknown], values: &[f64]) -> Self {
        let mut model = self.clone();
        for (unknown, value) in unknowns.iter().zip(values) {
            match &unknown.moves {
                Moves::Wheels(moves) => {
                    for (wheel, parameter, factor) in moves {
                        model.wheels[*wheel] = model.wheels[*wheel].changed(*parameter, factor * value);
                    }
                }
                Moves::Sensor(0) => model.sensor.x += value,
                Moves::Sensor(1) => model.sensor.y += value,
                Moves::Sensor(_) => model.sensor.theta += value,
            }
        }
        model
    }
}
