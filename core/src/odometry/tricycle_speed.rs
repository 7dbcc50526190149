//! A tricycle whose own controller tells its speed and steering angle.

use serde::{Deserialize, Serialize};

use super::Control;
use super::kinematics::{Believed, Kinematics, Step};
use crate::measurement::{SpeedSample, Time};

/// A tricycle whose front wheel steers and drives (K 2.1.1) and whose controller reports the speed of that wheel and its
/// steering angle; the speed changes linearly between reports. One that reports counters is [`super::Tricycle`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TricycleSpeed {
    /// Distance from the rear axle to the driving wheel's steering axis, m (K: L).
    pub wheelbase: f64,
    /// What is added to the reported steering angle, rad.
    pub steering_offset: f64,
}

impl Kinematics for TricycleSpeed {
    type Report = SpeedSample;

    fn time(report: &SpeedSample) -> Time {
        report.time
    }

    fn is_sound(&self, report: &SpeedSample) -> bool {
        report.speed.is_finite() && libm::fabs(report.steering) <= core::f64::consts::PI
    }

    fn step(&self, from: &SpeedSample, to: &SpeedSample, duration: f64, believed: &Believed) -> Step {
        let control = Control {
            distance: 0.5 * (from.speed + to.speed) * duration,
            steering_start: from.steering + self.steering_offset,
            steering_end: to.steering + self.steering_offset,
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
