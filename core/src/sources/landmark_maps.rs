//! The maps that the localiser compares its observations with.

use crate::maps::{DynamicMap, FixedMap};

/// The fixed maps and the dynamic one.
#[derive(Clone, Debug)]
pub(crate) struct Maps<const REFLECTORS: usize, const FEATURES: usize, const DYNAMIC: usize> {
    pub(crate) reflectors: FixedMap<REFLECTORS>,
    pub(crate) features: FixedMap<FEATURES>,
    pub(crate) dynamic: DynamicMap<DYNAMIC>,
}
