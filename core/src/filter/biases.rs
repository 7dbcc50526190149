//! What a calibration leaves, as part of the state.

use serde::{Deserialize, Serialize};

/// First of the states of each bias.
pub(super) const SCALE: usize = 3;
pub(super) const STEERING: usize = 4;
pub(super) const YAW: usize = 5;

/// How wrong a calibration may be: standard deviations.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BiasDeviations {
    /// Of the drive's scale, as a share.
    pub scale: f64,
    /// Of the steering angle, rad; of a vehicle without a steered wheel, rad/m.
    pub steering: f64,
    /// Of the laser's yaw, rad.
    pub laser_yaw: f64,
}

impl Default for BiasDeviations {
    /// Odometry of a vehicle that was calibrated badly; a laser whose yaw was calibrated (STC of K repeats within 1e-4 rad).
    fn default() -> Self {
        Self { scale: 5e-3, steering: 4e-3, laser_yaw: 3e-4 }
    }
}

/// How fast a calibration changes, by load, wear and what is mounted anew: random walks, standard deviations for a square
/// root of a metre.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BiasWalk {
    /// Of the drive's scale, as a share.
    pub scale: f32,
    /// Of the steering angle, rad; of a vehicle without a steered wheel, rad/m.
    pub steering: f32,
    /// Of the laser's yaw, rad.
    pub laser_yaw: f32,
}

impl BiasWalk {
    /// Biases that never change.
    pub const NONE: Self = Self { scale: 0.0, steering: 0.0, laser_yaw: 0.0 };
}

impl Default for BiasWalk {
    /// After one kilometre two thousandths of the scale, as tyres yield to loads, and 0.02 deg of the steering and of the laser,
    /// as bolts and bearings do to wear: what was learnt counts for some hundred metres, and ten metres hardly feel it.
    fn default() -> Self {
        Self { scale: 6e-5, steering: 1e-5, laser_yaw: 1e-5 }
    }
}

/// How the odometry's biases act on a motion, and how they change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BiasModel {
    /// As in [`crate::odometry::BiasJacobian::of`], m.
    pub lever: Option<f64>,
    /// How fast the biases change.
    pub walk: BiasWalk,
}

impl BiasModel {
    /// No bias acts on a motion.
    pub const NONE: Self = Self { lever: None, walk: BiasWalk::NONE };
}
