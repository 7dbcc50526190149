//! What was published while the localiser was still busy, and on what it rests, so that a replay can tell it again.

use serde::{Deserialize, Serialize};

use crate::state::PoseOutput;

/// A pose as the vehicle was given it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Published {
    /// The pose.
    pub pose: PoseOutput,
    /// How many of the events before it in the log the localiser had not answered yet for whoever published it.
    pub behind: u32,
}
