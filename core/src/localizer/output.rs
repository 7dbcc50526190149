//! What the localiser says.

use heapless::Vec;

use crate::state::{LandmarkUse, PoseOutput};

/// Observations of one event at the most.
pub const OBSERVATIONS: usize = 128;

/// Why an event was not used, or not as it stands: a fault of whoever feeds the localiser, not of the vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Misuse {
    /// The vehicle, as the parameters describe it, does not send such samples of its odometry.
    WrongVehicle,
    /// A sample of the odometry is not later than the one before.
    OutOfOrder,
    /// The parameters mount no such laser.
    UnknownLaser,
    /// A given pose is not finite, or its standard deviations are not positive.
    NoPose,
    /// A given pose is of a time that the filter has forgotten.
    TooLate,
}

/// Everything that one event gave.
#[derive(Clone, Debug)]
pub struct Outputs {
    /// The pose after the event.
    pub pose: PoseOutput,
    /// What became of the event's observations, in order of time.
    pub uses: Vec<LandmarkUse, OBSERVATIONS>,
    /// What was wrong with the event itself, if it was not used as it stands.
    pub misuse: Option<Misuse>,
    /// Whether something of the event found no room.
    pub(super) has_cut: bool,
}
