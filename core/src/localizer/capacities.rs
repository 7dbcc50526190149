//! How much a localiser has room for.

use serde::{Deserialize, Serialize};

/// How much a localiser has room for, as the log of its vehicle states it. One of another size may answer differently.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Capacities {
    /// Landmarks of the fixed maps, reflectors and features together.
    pub landmarks: u32,
    /// Beams of a scan.
    pub beams: u32,
    /// Motions and corrections of the filter's past.
    pub history: u32,
}
