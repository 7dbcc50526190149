//! Two driven wheels side by side.

use serde::{Deserialize, Serialize};

use super::{Contact, DrivenWheel, Wheel, WheelBased};

/// Two driven wheels on one axle, castors elsewhere; R is in the middle between the wheels. Its wheels are left and right.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Differential {
    /// Distance between the wheels' contacts, m.
    pub track: f64,
    /// The left wheel.
    pub left: DrivenWheel,
    /// The right wheel.
    pub right: DrivenWheel,
}

impl WheelBased for Differential {
    fn wheels(&self) -> impl AsRef<[Wheel]> {
        let half = 0.5 * self.track;
        [self.left.at(0.0, half, 0.0, Contact::Tyre), self.right.at(0.0, -half, 0.0, Contact::Tyre)]
    }
}
