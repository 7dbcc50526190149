//! What the localiser says.

use heapless::Vec;

use crate::state::{LandmarkUse, PoseOutput};

/// Observations of one event at the most.
pub const OBSERVATIONS: usize = 128;

/// Everything that one event gave.
#[derive(Clone, Debug)]
pub struct Outputs {
    /// The pose after the event.
    pub pose: PoseOutput,
    /// What became of the event's observations, in order of time.
    pub uses: Vec<LandmarkUse, OBSERVATIONS>,
    /// Whether something of the event found no room.
    pub(super) has_cut: bool,
}
