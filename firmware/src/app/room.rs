//! How much this image localises with.

use agv_core::filter::{packed_entries, slot_states};
use agv_core::localizer;

/// Past poses in the state of the filter.
const KEYS: usize = if cfg!(feature = "slam") { 4 } else { 0 };
/// Landmarks in the state of the filter.
const LANDMARKS: usize = if cfg!(feature = "slam") { 64 } else { 0 };
const STATES: usize = slot_states(KEYS, LANDMARKS);
const ENTRIES: usize = packed_entries(STATES);

/// Whether the localiser has room for landmarks in its state, without which `maps.slam` cannot be switched on.
pub const HAS_SLAM: bool = LANDMARKS > 0;

/// The localiser of this image: 1440 beams, 1000 reflectors and 1000 features of fixed maps, 256 found while driving.
pub type Localizer = localizer::Localizer<1440, 1000, 1000, 256, KEYS, LANDMARKS, STATES, ENTRIES>;
