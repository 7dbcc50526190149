//! Which of a vehicle's lasers.

use serde::{Deserialize, Serialize};

/// Most lasers of a vehicle.
pub const LASERS: usize = 2;

/// No vehicle has so many lasers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LaserIdError;

impl core::fmt::Display for LaserIdError {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(formatter, "a vehicle has at most {LASERS} lasers")
    }
}

impl core::error::Error for LaserIdError {}

/// The number of a laser: what it measures carries it, and the parameters hold a mount for each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "u8", into = "u8")]
pub struct LaserId(u8);

impl TryFrom<u8> for LaserId {
    type Error = LaserIdError;

    fn try_from(number: u8) -> Result<Self, LaserIdError> {
        Self::new(number).ok_or(LaserIdError)
    }
}

impl From<LaserId> for u8 {
    fn from(laser: LaserId) -> Self {
        laser.0
    }
}

impl LaserId {
    /// The laser of a vehicle that has one.
    pub const FIRST: Self = Self(0);

    /// A laser by its number, from 0. None if there cannot be so many.
    #[must_use]
    pub const fn new(number: u8) -> Option<Self> {
        if (number as usize) < LASERS { Some(Self(number)) } else { None }
    }

    /// Its number, from 0.
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}
