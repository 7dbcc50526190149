//! Two wheels that steer and drive.

use serde::{Deserialize, Serialize};

use super::{AngleEncoder, Contact, DrivenWheel, Wheel, WheelBased};

/// A wheel that steers and drives.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SteeredWheel {
    /// Place of its steering axis in R, m forward.
    pub x: f64,
    /// Place of its steering axis in R, m to the left.
    pub y: f64,
    /// What drives it.
    pub drive: DrivenWheel,
    /// What measures its steering angle.
    pub steering: AngleEncoder,
    /// What is added to the measured angle, rad.
    pub steering_offset: f64,
}

impl SteeredWheel {
    fn wheel(&self) -> Wheel {
        let wheel = self.drive.at(self.x, self.y, self.steering_offset, Contact::Tyre);
        Wheel { steering: Some(self.steering), ..wheel }
    }
}

/// Two wheels that steer and drive, castors elsewhere: four equations, one more than there are unknowns. R is anywhere; its
/// wheels are front and rear.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BiSteerable {
    /// The front wheel.
    pub front: SteeredWheel,
    /// The rear wheel.
    pub rear: SteeredWheel,
}

impl WheelBased for BiSteerable {
    fn wheels(&self) -> impl AsRef<[Wheel]> {
        [self.front.wheel(), self.rear.wheel()]
    }
}
