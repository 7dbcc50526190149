//! Four mecanum wheels.

use core::f64::consts::FRAC_PI_4;

use serde::{Deserialize, Serialize};

use super::{Contact, DrivenWheel, Wheel, WheelBased};

/// Four mecanum wheels at the corners of a rectangle about R, their rollers at an eighth of a turn, as an X seen from above:
/// wheels that turn alike move the vehicle forward. Its wheels are front left, front right, rear left, rear right.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mecanum {
    /// Distance between the axles, m.
    pub wheelbase: f64,
    /// Distance between the wheels' contacts, m.
    pub track: f64,
    /// The wheels.
    pub driven: [DrivenWheel; 4],
}

impl WheelBased for Mecanum {
    fn wheels(&self) -> impl AsRef<[Wheel]> {
        let (x, y) = (0.5 * self.wheelbase, 0.5 * self.track);
        let [front_left, front_right, rear_left, rear_right] = self.driven;
        let rollers = Contact::Rollers;
        [
            front_left.at(x, y, 0.0, rollers(-FRAC_PI_4)),
            front_right.at(x, -y, 0.0, rollers(FRAC_PI_4)),
            rear_left.at(-x, y, 0.0, rollers(FRAC_PI_4)),
            rear_right.at(-x, -y, 0.0, rollers(-FRAC_PI_4)),
        ]
    }
}
