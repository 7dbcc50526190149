//! How much a localiser has room for.

use agv_core::filter::{Slots, slot_states};
use agv_core::localizer::Capacities;

/// Whether there is room for past poses and landmarks in the state, without which `maps.slam` cannot be switched on.
#[must_use]
pub const fn has_slots<C: Capacities>() -> bool {
    C::Slots::STATES > slot_states(0, 0)
}
