//! Reflectors that the sensor itself, or a detector in front of the localiser, has found.

use serde::{Deserialize, Serialize};

use super::{LaserId, Time};

/// One reflector, seen from S at its own time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReflectorObservation {
    /// When the beam crossed the reflector.
    pub time: Time,
    /// Distance from the origin of S to the reflector's centre, m.
    pub range: f32,
    /// Direction in S, rad, counter-clockwise.
    pub bearing: f32,
}

/// The reflectors of one revolution, in order of time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Reflectors<'a> {
    /// Which laser has found them.
    pub laser: LaserId,
    /// Observations in order of time.
    pub observations: &'a [ReflectorObservation],
}

impl<'a> Reflectors<'a> {
    /// Reflectors of the laser of a vehicle that has one.
    #[must_use]
    pub const fn of_first(observations: &'a [ReflectorObservation]) -> Self {
        Self { laser: LaserId::FIRST, observations }
    }
}
