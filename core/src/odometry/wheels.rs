//! A vehicle of several wheels: the one model behind all kinematics but the closed forms.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::kinematics::{Believed, Kinematics, Step};
use super::wheel_path::WheelPath;
use super::{AngleEncoder, OdometryNoise, Wheel, WheelMotion, WheelParameter};
use crate::measurement::{Time, WheelReading, WheelSample};

/// A rigid vehicle on `N` wheels, at most [`crate::measurement::MOST_WHEELS`]. Each measured wheel says how far its contact has
/// moved along its direction, each tyre that it has not moved across; what is more than three equations is solved in least
/// squares, and what does not fit is slip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wheels<const N: usize>(pub [Wheel; N]);

/// A vehicle that is given by a few measures and stands for a set of wheels.
pub trait WheelBased: Copy + core::fmt::Debug {
    /// The wheels, in the order of [`WheelSample::wheels`].
    fn wheels(&self) -> impl AsRef<[Wheel]>;
}

impl<const N: usize> WheelBased for Wheels<N> {
    fn wheels(&self) -> impl AsRef<[Wheel]> {
        self.0
    }
}

/// What the encoders of a measured wheel say; it is the same for all wheels of most vehicles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DrivenWheel {
    /// Radius, m.
    pub radius: f64,
    /// What measures its turn.
    pub turn: AngleEncoder,
}

impl DrivenWheel {
    /// The wheel at a place of R (m), rolling toward `heading` (rad).
    #[must_use]
    pub const fn at(&self, x: f64, y: f64, heading: f64, contact: super::Contact) -> Wheel {
        Wheel { x, y, heading, radius: self.radius, contact, turn: Some(self.turn), steering: None }
    }
}

/// What a wheel did between two readings of its counters.
#[must_use]
pub fn wheel_motion_between(wheel: &Wheel, from: &WheelReading, to: &WheelReading) -> WheelMotion {
    let angle =
        |reading: u32| wheel.steering.map_or(0.0, |encoder| encoder.scale * encoder.range.signed(reading) as f64);
    WheelMotion {
        turn: wheel.turn.map_or(0.0, |encoder| encoder.scale * encoder.range.step(from.count, to.count) as f64),
        steering_start: angle(from.steering),
        steering_end: angle(to.steering),
    }
}

/// Mean distance of the measured wheels, m.
fn mean_distance(wheels: &[Wheel], motions: &[WheelMotion]) -> f64 {
    let measured = wheels.iter().zip(motions).filter(|(wheel, _)| wheel.turn.is_some());
    let (sum, count) = measured
        .fold((0.0, 0.0), |(sum, count), (wheel, motion)| (sum + libm::fabs(wheel.radius * motion.turn), count + 1.0));
    if count > 0.0 { sum / count } else { 0.0 }
}

/// Covariance of the displacement of that path: slip of every wheel, errors of its encoders, and what the model does not know.
/// Where redundant wheels contradict each other by more than their slip, all are believed so much less.
fn covariance(path: &WheelPath, wheels: &[Wheel], distance: f64, duration: f64, noise: &OdometryNoise) -> Matrix3<f64> {
    let solution = path.middle();
    let expected = solution.redundancy as f64 * distance;
    let excess = if expected > 0.0 { libm::fmax(solution.misfit / expected, 1.0) } else { 1.0 };
    let mut covariance = solution.spread * (distance * excess);
    let mut add = |by: Vector3<f64>, deviation: f64| covariance += by * by.transpose() * (deviation * deviation);
    for (number, wheel) in wheels.iter().enumerate() {
        if wheel.turn.is_some() && noise.speed > 0.0 && wheel.radius != 0.0 {
            add(path.derivative(number, WheelParameter::Turn), noise.speed * duration / wheel.radius);
        }
        if wheel.steering.is_some() {
            add(path.derivative(number, WheelParameter::Heading), noise.steering);
        }
    }
    covariance.m33 += noise.yaw * noise.yaw * distance;
    covariance
}

/// The step that those wheels made in `duration` seconds. Its displacement is not a number if they do not determine it.
fn step_of(wheels: &[Wheel], motions: &[WheelMotion], duration: f64, believed: &Believed) -> Step {
    let distance = mean_distance(wheels, motions);
    let Some(path) = WheelPath::new(wheels, motions, &believed.noise, believed.integration) else {
        return Step { distance: f64::NAN, ..Step::standing(believed.was_backward) };
    };
    let along = path.middle().motion.x;
    Step {
        displacement: path.displacement(),
        covariance: covariance(&path, wheels, distance, duration, &believed.noise),
        distance,
        is_backward: if along == 0.0 { believed.was_backward } else { along < 0.0 },
        slip: path.middle().slip,
    }
}

impl<V: WheelBased> Kinematics for V {
    type Report = WheelSample;

    fn time(report: &WheelSample) -> Time {
        report.time
    }

    fn is_sound(&self, _: &WheelSample) -> bool {
        true
    }

    fn step(&self, from: &WheelSample, to: &WheelSample, duration: f64, believed: &Believed) -> Step {
        let wheels = self.wheels();
        let mut motions = [WheelMotion::default(); crate::measurement::MOST_WHEELS];
        let readings = from.wheels.iter().zip(&to.wheels);
        for ((motion, wheel), (from, to)) in motions.iter_mut().zip(wheels.as_ref()).zip(readings) {
            *motion = wheel_motion_between(wheel, from, to);
        }
        step_of(wheels.as_ref(), &motions, duration, believed)
    }

    fn steering_lever(&self) -> Option<f64> {
        None
    }

    /// At its fastest no wheel may go half of its counter's range; beyond, it may seem to go the other way.
    fn longest_interval(&self, fastest: f64) -> f64 {
        let longest = |wheel: &Wheel| {
            let encoder = wheel.turn?;
            Some(0.5 * encoder.range.values() as f64 * libm::fabs(encoder.scale * wheel.radius) / fastest)
        };
        self.wheels().as_ref().iter().filter_map(longest).fold(f64::INFINITY, libm::fmin)
    }
}
