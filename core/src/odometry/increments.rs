//! A vehicle that integrates its motion itself.

use core::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::kinematics::{Believed, Kinematics, Step};
use crate::measurement::{PoseIncrement, Time};

/// It reports the displacement since the report before.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Increments;

impl Kinematics for Increments {
    type Report = PoseIncrement;

    fn time(report: &PoseIncrement) -> Time {
        report.time
    }

    fn is_sound(&self, _: &PoseIncrement) -> bool {
        true
    }

    fn step(&self, _: &PoseIncrement, to: &PoseIncrement, duration: f64, believed: &Believed) -> Step {
        let displacement = to.displacement;
        let distance = libm::hypot(displacement.x, displacement.y);
        // Half a turn either way is all that a heading can say.
        let is_turn = libm::fabs(displacement.theta) <= PI;
        Step {
            displacement,
            covariance: believed.noise.of_displacement(distance, displacement.theta, duration),
            distance: if is_turn { distance } else { f64::NAN },
            is_backward: displacement.x < 0.0,
            slip: 0.0,
        }
    }

    fn steering_lever(&self) -> Option<f64> {
        None
    }

    fn longest_interval(&self, _: f64) -> f64 {
        f64::INFINITY
    }

    fn resolution(&self) -> Option<f64> {
        Some(0.0)
    }
}
