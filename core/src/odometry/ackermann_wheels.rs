//! A car with counters at its rear wheels.

use serde::{Deserialize, Serialize};

use super::{AngleEncoder, Contact, Differential, Wheel, WheelBased};

/// A car whose rear wheels are counted and whose steering angle is that of a virtual wheel in the middle of the front axle. R is in
/// the middle of the rear axle. Its wheels are rear left, rear right, front. A car that reports a speed is
/// [`super::Ackermann`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AckermannWheels {
    /// The rear wheels.
    pub rear: Differential,
    /// Distance between the axles, m.
    pub wheelbase: f64,
    /// What measures the steering angle.
    pub steering: AngleEncoder,
    /// What is added to the measured angle, rad.
    pub steering_offset: f64,
}

impl WheelBased for AckermannWheels {
    fn wheels(&self) -> impl AsRef<[Wheel]> {
        let half = 0.5 * self.rear.track;
        let front = Wheel {
            x: self.wheelbase,
            y: 0.0,
            heading: self.steering_offset,
            radius: 0.0,
            contact: Contact::Tyre,
            turn: None,
            steering: Some(self.steering),
        };
        let Differential { left, right, .. } = self.rear;
        [left.at(0.0, half, 0.0, Contact::Tyre), right.at(0.0, -half, 0.0, Contact::Tyre), front]
    }
}
