//! A car with a speed sensor on one rear wheel.

use serde::{Deserialize, Serialize};

use super::Control;
use super::kinematics::{Believed, Kinematics, Step};
use crate::measurement::{SpeedSample, Time};

/// A car: the rear-left wheel carries the speed sensor and the steering angle is that of a virtual wheel in the middle
/// of the front axle. It reports speed and steering angle; the speed changes linearly between reports.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ackermann {
    /// Distance between the axles, m.
    pub wheelbase: f64,
    /// Distance of the wheel with the speed sensor to the left of the vehicle's axis, m.
    pub encoder_offset: f64,
}

impl Ackermann {
    /// Speed of the virtual wheel, m/s.
    fn wheel_speed(&self, report: &SpeedSample) -> f64 {
        let (sine, cosine) = libm::sincos(report.steering);
        report.speed / (cosine - sine * self.encoder_offset / self.wheelbase)
    }
}

impl Kinematics for Ackermann {
    type Report = SpeedSample;

    fn time(report: &SpeedSample) -> Time {
        report.time
    }

    fn is_sound(&self, report: &SpeedSample) -> bool {
        report.speed.is_finite() && libm::fabs(report.steering) < core::f64::consts::FRAC_PI_2
    }

    fn step(&self, from: &SpeedSample, to: &SpeedSample, duration: f64, believed: &Believed) -> Step {
        let control = Control {
            distance: 0.5 * (self.wheel_speed(from) + self.wheel_speed(to)) * duration,
            steering_start: from.steering,
            steering_end: to.steering,
        };
        control.step(self.wheelbase, duration, believed)
    }

    fn steering_lever(&self) -> Option<f64> {
        Some(self.wheelbase)
    }

    fn longest_interval(&self, _: f64) -> f64 {
        f64::INFINITY
    }

    fn resolution(&self) -> Option<f64> {
        None
    }
}
