//! What the localiser is told.

use crate::measurement::{EncoderFaults, EncoderSample, PoseFix, PoseIncrement, Reflectors, Scan, SpeedSample, Time};

/// One thing that a sensor or an operator said, with the time at which it was true.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event<'a> {
    /// Counters of a tricycle's encoders.
    Encoders(EncoderSample),
    /// What is wrong with a tricycle's encoders: when it changes, and again and again while there is a fault, as
    /// nothing else tells the time then.
    EncoderFaults(EncoderFaults),
    /// Speed and steering angle.
    Speed(SpeedSample),
    /// Motion that the vehicle has integrated itself.
    Increment(PoseIncrement),
    /// Reflectors that the sensor has found.
    Reflectors(Reflectors<'a>),
    /// Ranges of one sweep of the laser.
    Scan(Scan<'a>),
    /// A pose from outside.
    SetPose(PoseFix),
}

impl Event<'_> {
    /// When the first thing in it was seen, and the last one.
    #[inline]
    pub(super) fn seen(&self) -> Option<(Time, Time)> {
        match self {
            Self::Reflectors(reflectors) => {
                reflectors.observations.first().zip(reflectors.observations.last()).map(|(a, b)| (a.time, b.time))
            }
            Self::Scan(scan) => Some((scan.start, scan.end())),
            _ => None,
        }
    }
}
