//! Which way the sensor's angles grow.

/// Which way the sensor's angles grow, seen from above: `NEVACoordOrientation`. That 0 is counter-clockwise and 1 clockwise is not
/// verified.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Orientation {
    /// To the left.
    CounterClockwise = 0,
    /// To the right.
    Clockwise = 1,
}

impl Orientation {
    /// The one with that number.
    #[must_use]
    pub const fn of_number(number: u8) -> Option<Self> {
        match number {
            0 => Some(Self::CounterClockwise),
            1 => Some(Self::Clockwise),
            _ => None,
        }
    }
}
