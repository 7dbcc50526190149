//! A vehicle of several wheels: the one model behind all kinematics but the closed forms.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::counter::ticks_as_f64;
use super::kinematics::{Believed, Kinematics, Step};
use super::wheel_equations::{LEAST_SLIP, WheelFit};
use super::wheel_path::WheelPath;
use super::wheel_set::RollingWheel;
use super::{AngleEncoder, OdometryNoise, Wheel, WheelMotion, WheelParameter, WheelSet};
use crate::measurement::{MOST_WHEELS, Time, WheelReading, WheelSample};

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
    let angle = |ticks: i64| wheel.steering.map_or(0.0, |encoder| encoder.scale * ticks_as_f64(ticks));
    // The wheel may pass the end of the counter's range.
    let (start, end) = wheel.steering.map_or((0, 0), |AngleEncoder { range, .. }| {
        let start = range.signed(from.steering);
        (start, start + range.step(from.steering, to.steering))
    });
    WheelMotion {
        turn: wheel.turn.map_or(0.0, |encoder| encoder.scale * ticks_as_f64(encoder.range.step(from.count, to.count))),
        steering_start: angle(start),
        steering_end: angle(end),
    }
}

/// Mean distance of the measured wheels, m.
fn mean_distance(set: &WheelSet, motions: &[WheelMotion]) -> f64 {
    let measured = set.wheels().iter().zip(motions).filter(|(rolling, _)| rolling.is_measured());
    let (sum, count) = measured.fold((0.0, 0.0), |(sum, count), (rolling, motion)| {
        (sum + libm::fabs(rolling.wheel.radius * motion.turn), count + 1.0)
    });
    if count > 0.0 { sum / count } else { 0.0 }
}

/// Covariance of the displacement of that path: slip of every wheel, errors of its encoders, and what the model does not know.
/// Where redundant wheels contradict each other by more than their slip, all are believed so much less.
fn covariance(
    path: &WheelPath,
    fit: &WheelFit,
    set: &WheelSet,
    distance: f64,
    duration: f64,
    noise: &OdometryNoise,
) -> Matrix3<f64> {
    // A reading is rounded to a tick, so that a difference of two has the variance of a sixth of its square.
    let tick = if fit.redundancy > 0 { set.resolution().unwrap_or_default() / noise.slip.max(LEAST_SLIP) } else { 0.0 };
    let expected = fit.redundancy as f64 * (distance + tick * tick / 6.0);
    let excess = if expected > 0.0 { libm::fmax(fit.misfit / expected, 1.0) } else { 1.0 };
    let mut covariance = path.spread() * (distance * excess);
    let mut add = |by: Vector3<f64>, deviation: f64| covariance += by * by.transpose() * (deviation * deviation);
    for (number, RollingWheel { wheel, .. }) in set.wheels().iter().enumerate() {
        if wheel.turn.is_some() && noise.speed > 0.0 && wheel.radius != 0.0 {
            add(path.derivative(number, WheelParameter::Turn), noise.speed * duration / wheel.radius);
        }
        if wheel.steering.is_some() {
            add(path.derivative(number, WheelParameter::Heading), noise.steering);
        }
    }
    covariance.m33 += noise.of_heading(distance, path.middle().z);
    covariance
}

impl Kinematics for WheelSet {
    type Report = WheelSample;

    fn time(report: &WheelSample) -> Time {
        report.time
    }

    fn is_sound(&self, _: &WheelSample) -> bool {
        true
    }

    /// Its displacement is not a number if the wheels do not determine it.
    fn step(&self, from: &WheelSample, to: &WheelSample, duration: f64, believed: &Believed) -> Step {
        let mut motions = [WheelMotion::default(); MOST_WHEELS];
        let readings = from.wheels.iter().zip(&to.wheels);
        for ((motion, rolling), (from, to)) in motions.iter_mut().zip(self.wheels()).zip(readings) {
            *motion = wheel_motion_between(&rolling.wheel, from, to);
        }
        let distance = mean_distance(self, &motions);
        let mut path = WheelPath::unsolved(self, &motions, &believed.noise, believed.integration);
        if path.solve().is_none() {
            return Step { distance: f64::NAN, ..Step::standing(believed.was_backward) };
        }
        let (along, fit) = (path.middle().x, path.fit());
        Step {
            displacement: path.displacement(),
            covariance: covariance(&path, &fit, self, distance, duration, &believed.noise),
            distance,
            is_backward: if along == 0.0 { believed.was_backward } else { along < 0.0 },
            slip: fit.slip,
        }
    }

    fn steering_lever(&self) -> Option<f64> {
        None
    }

    /// At its fastest no wheel may go half of its counter's range; beyond, it may seem to go the other way.
    fn longest_interval(&self, fastest: f64) -> f64 {
        let longest = |rolling: &RollingWheel| {
            let encoder = rolling.wheel.turn?;
            Some(0.5 * encoder.range.values() as f64 * libm::fabs(encoder.scale * rolling.wheel.radius) / fastest)
        };
        self.wheels().iter().filter_map(longest).fold(f64::INFINITY, libm::fmin)
    }

    fn resolution(&self) -> Option<f64> {
        let tick = |rolling: &RollingWheel| Some(libm::fabs(rolling.wheel.turn?.scale * rolling.wheel.radius));
        Some(self.wheels().iter().filter_map(tick).fold(0.0, libm::fmax))
    }
}

/// As the [`WheelSet`] of its wheels, which an odometer would rather have: it is prepared once.
impl<V: WheelBased> Kinematics for V {
    type Report = WheelSample;

    fn time(report: &WheelSample) -> Time {
        WheelSet::time(report)
    }

    fn is_sound(&self, report: &WheelSample) -> bool {
        WheelSet::of(self.wheels().as_ref()).is_sound(report)
    }

    fn step(&self, from: &WheelSample, to: &WheelSample, duration: f64, believed: &Believed) -> Step {
        WheelSet::of(self.wheels().as_ref()).step(from, to, duration, believed)
    }

    fn steering_lever(&self) -> Option<f64> {
        None
    }

    fn longest_interval(&self, fastest: f64) -> f64 {
        WheelSet::of(self.wheels().as_ref()).longest_interval(fastest)
    }

    fn resolution(&self) -> Option<f64> {
        WheelSet::of(self.wheels().as_ref()).resolution()
    }
}
