//! From the distance and the angle of a steered wheel to the displacement of the logical point.

use nalgebra::Matrix3x2;
use serde::{Deserialize, Serialize};

use super::kinematics::{Believed, Step};
use crate::geometry::{Pose, Twist};

/// What the steered wheel did between two samples; its angle changes linearly with the distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Control {
    /// Distance travelled by the wheel, m, negative backward (K: v dt).
    pub distance: f64,
    /// Steering angle at the start, rad, offset included (K: alpha_(k-1)).
    pub steering_start: f64,
    /// Steering angle at the end, rad, offset included (K: alpha_k).
    pub steering_end: f64,
}

/// How a control is integrated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Integration {
    /// Second-order Runge-Kutta, K 5.8.
    #[default]
    RungeKutta2,
    /// The arc that a constant mean steering angle makes, K 2.8 and 2.9 in a form that is continuous through straight
    /// motion, where 2.9 as printed is 0/0.
    Arc,
    /// Fourth-order Runge-Kutta.
    RungeKutta4,
}

impl Control {
    /// Mean steering angle, rad (K 5.10: alpha_2).
    fn mean_steering(&self) -> f64 {
        0.5 * (self.steering_end + self.steering_start)
    }

    /// Steering angle after a quarter of the distance, rad (K 5.11: alpha_34).
    fn quarter_steering(&self) -> f64 {
        0.25 * (self.steering_end + 3.0 * self.steering_start)
    }

    /// The step that it makes in `duration` seconds, for a wheel `wheelbase` (m) ahead of the rear axle.
    pub(super) fn step(&self, wheelbase: f64, duration: f64, believed: &Believed) -> Step {
        Step {
            displacement: self.displacement(wheelbase, believed.integration),
            covariance: believed.noise.of_control(self, wheelbase, duration),
            distance: libm::fabs(self.distance),
            is_backward: self.distance < 0.0,
            slip: 0.0,
        }
    }

    /// Displacement of R, in R at the start, for a wheel `wheelbase` (m) ahead of the rear axle.
    #[must_use]
    pub fn displacement(&self, wheelbase: f64, integration: Integration) -> Pose {
        match integration {
            Integration::RungeKutta2 => self.runge_kutta_2(wheelbase),
            Integration::Arc => self.arc(wheelbase),
            Integration::RungeKutta4 => self.runge_kutta_4(wheelbase),
        }
    }

    /// K 5.8 with 5.9 to 5.11, seen from R at the start.
    fn runge_kutta_2(&self, wheelbase: f64) -> Pose {
        let (sine, cosine) = libm::sincos(self.mean_steering());
        let heading = 0.5 * self.distance / wheelbase * libm::sin(self.quarter_steering());
        let (heading_sine, heading_cosine) = libm::sincos(heading);
        let along = self.distance * cosine;
        Pose::new(along * heading_cosine, along * heading_sine, self.distance / wheelbase * sine)
    }

    fn arc(&self, wheelbase: f64) -> Pose {
        let (sine, cosine) = libm::sincos(self.mean_steering());
        Pose::exp(&Twist { x: self.distance * cosine, y: 0.0, theta: self.distance / wheelbase * sine })
    }

    fn runge_kutta_4(&self, wheelbase: f64) -> Pose {
        // The steering angle depends on the distance alone, so the heading's two middle slopes coincide.
        let slope = |steering: f64| self.distance / wheelbase * libm::sin(steering);
        let (start, middle, end) = (slope(self.steering_start), slope(self.mean_steering()), slope(self.steering_end));
        let step = |heading: f64, steering: f64| {
            let (sine, cosine) = libm::sincos(heading);
            let along = self.distance * libm::cos(steering);
            (along * cosine, along * sine)
        };
        let first = step(0.0, self.steering_start);
        let second = step(0.5 * start, self.mean_steering());
        let third = step(0.5 * middle, self.mean_steering());
        let fourth = step(middle, self.steering_end);
        Pose::new(
            (first.0 + 2.0 * (second.0 + third.0) + fourth.0) / 6.0,
            (first.1 + 2.0 * (second.1 + third.1) + fourth.1) / 6.0,
            (start + 4.0 * middle + end) / 6.0,
        )
    }

    /// Derivative of the displacement (K 5.8) by the distance (first column) and by a shift of the steering angle (second).
    #[must_use]
    pub fn jacobian(&self, wheelbase: f64) -> Matrix3x2<f64> {
        let (sine, cosine) = libm::sincos(self.mean_steering());
        let (quarter_sine, quarter_cosine) = libm::sincos(self.quarter_steering());
        let heading_by_way = 0.5 / wheelbase * quarter_sine;
        let heading_by_steering = 0.5 * self.distance / wheelbase * quarter_cosine;
        let (heading_sine, heading_cosine) = libm::sincos(self.distance * heading_by_way);
        let distance = self.distance;
        Matrix3x2::new(
            cosine * (heading_cosine - distance * heading_sine * heading_by_way),
            -distance * (heading_sine * heading_by_steering * cosine + heading_cosine * sine),
            cosine * (heading_sine + distance * heading_cosine * heading_by_way),
            distance * (heading_cosine * heading_by_steering * cosine - heading_sine * sine),
            sine / wheelbase,
            distance / wheelbase * cosine,
        )
    }
}
