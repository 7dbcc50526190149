//! The wheels of one rigid vehicle, prepared for many steps.

use serde::{Deserialize, Serialize};

use super::{Contact, Wheel};
use crate::measurement::MOST_WHEELS;

/// Wheels of one vehicle, with what of their directions is the same in every step.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct WheelSet {
    wheels: [RollingWheel; MOST_WHEELS],
    count: usize,
}

impl WheelSet {
    /// A set of at most [`MOST_WHEELS`]: more cannot be reported, and such a set is empty, so that it tells no motion.
    #[must_use]
    pub fn of(wheels: &[Wheel]) -> Self {
        let mut set = Self { wheels: [RollingWheel::of(&NO_WHEEL); MOST_WHEELS], count: 0 };
        if wheels.len() <= MOST_WHEELS {
            set.wheels.iter_mut().zip(wheels).for_each(|(place, wheel)| *place = RollingWheel::of(wheel));
            set.count = wheels.len();
        }
        set
    }

    /// The wheels in their order.
    pub(super) fn wheels(&self) -> &[RollingWheel] {
        self.wheels.get(..self.count).unwrap_or_default()
    }

    /// The wheel of that number.
    pub(super) fn get(&self, number: usize) -> Option<&RollingWheel> {
        self.wheels().get(number)
    }
}

const NO_WHEEL: Wheel =
    Wheel { x: 0.0, y: 0.0, heading: 0.0, radius: 0.0, contact: Contact::Tyre, turn: None, steering: None };

/// A wheel with the direction along which its turn tells the motion.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct RollingWheel {
    pub wheel: Wheel,
    /// That direction while its steering encoder reads zero, rad: its own, or that of its rollers' axes.
    angle: f64,
    /// Sine and cosine of it.
    straight: (f64, f64),
    /// Way along that direction for each rad of turn, m: radius times cosine of the rollers.
    pub way: f64,
}

impl RollingWheel {
    fn of(wheel: &Wheel) -> Self {
        let (angle, share) = match wheel.contact {
            Contact::Tyre => (wheel.heading, 1.0),
            Contact::Rollers(roller) => (wheel.heading + roller, libm::cos(roller)),
        };
        Self { wheel: *wheel, angle, straight: libm::sincos(angle), way: wheel.radius * share }
    }

    /// Sine and cosine of the direction while the steering encoder says `steering`, rad. A fixed wheel has no steering angle,
    /// whatever is reported.
    pub fn direction(&self, steering: f64) -> (f64, f64) {
        if self.wheel.steering.is_some() { libm::sincos(self.angle + steering) } else { self.straight }
    }

    /// Whether its turn is measured.
    pub const fn is_measured(&self) -> bool {
        self.wheel.turn.is_some()
    }

    /// Whether it does not move across its direction.
    pub const fn is_tyre(&self) -> bool {
        matches!(self.wheel.contact, Contact::Tyre)
    }
}
