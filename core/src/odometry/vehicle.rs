//! What kind of vehicle it is, and its parameters.

use serde::{Deserialize, Serialize};

use super::{Ackermann, Increments, Kinematics, Tricycle, TricycleSpeed, WheelVehicle};

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
    /// Encoder counters of several wheels.
    Wheels(WheelVehicle),
    /// Speed and steering angle of a steered driving wheel.
    TricycleSpeed(TricycleSpeed),
}

impl Vehicle {
    /// Whether it can move to the side without turning; who integrates its own motion may.
    #[must_use]
    pub const fn moves_sideways(&self) -> bool {
        match self {
            Self::Tricycle(_) | Self::Ackermann(_) | Self::TricycleSpeed(_) => false,
            Self::Increments => true,
            Self::Wheels(vehicle) => !matches!(vehicle, WheelVehicle::Differential(_) | WheelVehicle::Ackermann(_)),
        }
    }

    /// See [`Kinematics::steering_lever`].
    #[must_use]
    pub fn steering_lever(&self) -> Option<f64> {
        match self {
            Self::Tricycle(tricycle) => tricycle.steering_lever(),
            Self::Ackermann(car) => car.steering_lever(),
            Self::Increments => Increments.steering_lever(),
            Self::Wheels(vehicle) => vehicle.steering_lever(),
            Self::TricycleSpeed(tricycle) => tricycle.steering_lever(),
        }
    }
}
