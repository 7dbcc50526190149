//! What kind of vehicle it is, and its parameters.

use serde::{Deserialize, Serialize};

use super::CounterRange;

/// A tricycle whose front wheel steers and drives (K 2.1.1), with one steering offset for each direction of travel
/// (K 2.1.2); the standard model is the one in which both are equal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tricycle {
    /// Distance from the rear axle to the driving wheel's steering axis, m (K: L).
    pub wheelbase: f64,
    /// Way of the driving wheel for one tick, m (K: s_w).
    pub drive_scale: f64,
    /// Range of the driving wheel's counter.
    pub drive_range: CounterRange,
    /// Steering angle for one tick, rad.
    pub steering_scale: f64,
    /// Range of the steering counter; readings in its upper half are negative angles.
    pub steering_range: CounterRange,
    /// What is added to the measured steering angle while driving forward, rad (K 2.6: alpha_F).
    pub steering_offset_forward: f64,
    /// What is added to the measured steering angle while driving backward, rad (K 2.6: alpha_B).
    pub steering_offset_backward: f64,
}

/// A car: the rear-left wheel carries the speed sensor and the steering angle is that of a virtual wheel in the middle
/// of the front axle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ackermann {
    /// Distance between the axles, m.
    pub wheelbase: f64,
    /// Distance of the wheel with the speed sensor to the left of the vehicle's axis, m.
    pub encoder_offset: f64,
}

/// How the vehicle moves and what it reports of that.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Vehicle {
    /// Encoder counters of a steered driving wheel.
    Tricycle(Tricycle),
    /// Speed of one rear wheel and a steering angle.
    Ackermann(Ackermann),
    /// Displacements that the vehicle has integrated itself.
    Increments,
}
