//! The maps that the localiser compares its observations with.

use crate::maps::{DynamicMap, FixedMap};

/// The fixed maps and the dynamic one.
#[derive(Clone, Debug)]
pub(super) struct Maps<const REFLECTORS: usize, const FEATURES: usize, const DYNAMIC: usize> {
    pub(super) reflectors: FixedMap<REFLECTORS>,
    pub(super) features: FixedMap<FEATURES>,
    pub(super) dynamic: DynamicMap<DYNAMIC>,
}
