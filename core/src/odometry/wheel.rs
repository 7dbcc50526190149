//! One wheel on the floor.

use serde::{Deserialize, Serialize};

use super::CounterRange;

/// How a wheel touches the floor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Contact {
    /// A tyre, which does not move across its direction.
    Tyre,
    /// Rollers that turn freely about axes at this angle from the wheel's direction, rad: zero for an omnidirectional wheel,
    /// whose rollers let it move across; an eighth of a turn, of either sign, for a mecanum wheel.
    Rollers(f64),
}

/// An encoder: its range, and the angle of one tick.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AngleEncoder {
    /// Angle for one tick, rad; negative if it counts the other way.
    pub scale: f64,
    /// Range of the counter.
    pub range: CounterRange,
}

/// One wheel, steered or fixed, its turn measured or not. Frame R.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wheel {
    /// Where it touches the floor, m forward of R.
    pub x: f64,
    /// Where it touches the floor, m to the left of R.
    pub y: f64,
    /// Direction in which it rolls forward, rad from forward to the left; of a steered wheel while its encoder reads zero,
    /// so that this is the offset of its steering.
    pub heading: f64,
    /// Radius, m.
    pub radius: f64,
    /// How it touches the floor.
    pub contact: Contact,
    /// What measures its turn; none for a wheel that only carries.
    pub turn: Option<AngleEncoder>,
    /// What measures its steering angle; none for a fixed wheel.
    pub steering: Option<AngleEncoder>,
}

/// What a wheel did between two reports: its steering angle changes evenly with its turn.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WheelMotion {
    /// How far it has turned about its axis, rad, positive forward.
    pub turn: f64,
    /// What its steering encoder said at the start, rad, without the offset.
    pub steering_start: f64,
    /// What its steering encoder said at the end, rad, without the offset.
    pub steering_end: f64,
}

impl WheelMotion {
    /// What the steering encoder said after that share of the step, rad.
    #[must_use]
    pub fn steering_at(&self, share: f64) -> f64 {
        self.steering_start + share * (self.steering_end - self.steering_start)
    }
}

/// What of a wheel can be calibrated, or disturbs what it says.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WheelParameter {
    /// [`Wheel::x`], m.
    X,
    /// [`Wheel::y`], m.
    Y,
    /// [`Wheel::heading`], rad: mounting angle of a fixed wheel, steering offset of a steered one.
    Heading,
    /// [`Wheel::radius`], m.
    Radius,
    /// True steering angle over what the encoder says; one, until somebody changes the encoder's scale.
    SteeringRatio,
    /// Angle of the rollers, rad.
    Roller,
    /// Error of the turn that was measured, rad.
    Turn,
}

impl Wheel {
    /// The wheel with that parameter changed by `change`. A parameter that it does not have changes nothing.
    #[must_use]
    pub fn changed(mut self, parameter: WheelParameter, change: f64) -> Self {
        match (parameter, &mut self.contact, &mut self.steering) {
            (WheelParameter::X, ..) => self.x += change,
            (WheelParameter::Y, ..) => self.y += change,
            (WheelParameter::Heading, ..) => self.heading += change,
            (WheelParameter::Radius, ..) => self.radius += change,
            (WheelParameter::SteeringRatio, _, Some(encoder)) => encoder.scale *= 1.0 + change,
            (WheelParameter::Roller, Contact::Rollers(angle), _) => *angle += change,
            _ => {}
        }
        self
    }
}
