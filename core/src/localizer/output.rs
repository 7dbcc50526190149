//! What the localiser says.

use heapless::Vec;
use serde::{Deserialize, Serialize};

pub use crate::sources::OBSERVATIONS;
use crate::sources::Statuses;
use crate::state::{LandmarkUse, PoseOutput};

/// Why an event was not used, or not as it stands: a fault of whoever feeds the localiser, not of the vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
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
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Outputs {
    /// The pose after the event.
    pub pose: PoseOutput,
    /// What became of the event's observations, in order of time.
    pub uses: Vec<LandmarkUse, OBSERVATIONS>,
    /// What became of each source, in the last event in which it told something.
    pub sources: Statuses,
    /// What was wrong with the event itself, if it was not used as it stands.
    pub misuse: Option<Misuse>,
    /// Whether something of the event found no room.
    pub(super) has_cut: bool,
}
