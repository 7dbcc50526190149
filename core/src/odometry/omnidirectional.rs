//! Omnidirectional wheels around a middle.

use core::f64::consts::{FRAC_PI_2, TAU};

use super::{Contact, DrivenWheel, Wheel, WheelBased};

/// `N` omnidirectional wheels, three or four, evenly on a circle about R. Each rolls along the circle, to the left seen from
/// outside while it counts up, so that the vehicle turns to the left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Omnidirectional<const N: usize> {
    /// Distance from R to the wheels' contacts, m.
    pub arm: f64,
    /// Direction from R to the first wheel, rad from forward to the left; the others follow to the left.
    pub first: f64,
    /// The wheels.
    pub driven: [DrivenWheel; N],
}

impl<const N: usize> WheelBased for Omnidirectional<N> {
    fn wheels(&self) -> impl AsRef<[Wheel]> {
        let mut number = 0.0;
        self.driven.map(|driven| {
            let place = self.first + TAU * number / N as f64;
            number += 1.0;
            let (sine, cosine) = libm::sincos(place);
            driven.at(self.arm * cosine, self.arm * sine, place + FRAC_PI_2, Contact::Rollers(0.0))
        })
    }
}
