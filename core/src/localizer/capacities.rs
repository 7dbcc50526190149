//! How much a localiser has room for.

use core::fmt::Debug;

use serde::{Deserialize, Serialize};

use crate::filter::{PoseAndSlots, Slots, packed_entries, slot_states};
use crate::sources::{
    Contours, FeatureFinder, FindContours, FindFeatures, LandmarkMaps, Lent, MapKeeping, Maps, NoContours, Own,
};

/// The memory of a localiser. [`CapacitiesOf`] makes it of numbers.
pub trait Capacities: Clone + Debug {
    /// State of the filter.
    type Slots: Slots;
    /// Landmarks that are compared with what is seen.
    type Maps: LandmarkMaps;
    /// Points of a scan, and what finds features in them.
    type Features: FindFeatures;
    /// Surroundings by a kept map of contours, and what finds a scan in them.
    type Contours: FindContours;
}

/// Room for `BEAMS` beams of a scan, `REFLECTORS` and `FEATURES` landmarks of the fixed maps, `DYNAMIC` landmarks that are
/// found while driving, in the filter's state for `S`, and for contours as `K` says. The localiser has its fixed maps
/// as `M` says: a copy ([`Own`]), or lent ([`Lent`]).
#[derive(Clone, Copy, Debug)]
pub struct CapacitiesOf<
    const BEAMS: usize,
    const REFLECTORS: usize,
    const FEATURES: usize,
    const DYNAMIC: usize,
    S = SlamSlots,
    K = NoContours,
    M = Own,
>(core::marker::PhantomData<(S, K, M)>);

impl<const BEAMS: usize, const REFLECTORS: usize, const FEATURES: usize, const DYNAMIC: usize, S, K, M> Capacities
    for CapacitiesOf<BEAMS, REFLECTORS, FEATURES, DYNAMIC, S, K, M>
where
    S: Slots,
    K: FindContours,
    M: MapKeeping,
{
    type Slots = S;
    type Maps = Maps<M::Map<REFLECTORS>, M::Map<FEATURES>, DYNAMIC>;
    type Features = FeatureFinder<BEAMS>;
    type Contours = K;
}

const SLAM_STATES: usize = slot_states(4, 64);

/// The state of a filter with 4 past poses, which have key scans, and 64 landmarks.
pub type SlamSlots = PoseAndSlots<4, 64, SLAM_STATES, { packed_entries(SLAM_STATES) }>;

/// The state of a filter with biases only.
pub type NoSlots = PoseAndSlots<0, 0, { slot_states(0, 0) }, { packed_entries(slot_states(0, 0)) }>;

/// The room for everything: 1440 beams, 1000 reflectors and 1000 features of fixed maps, 256 landmarks found while driving, the
/// map in the state, and contours of the way behind or of a map that is lent for `'m`.
pub type ContourCapacities<'m> = CapacitiesOf<1440, 1000, 1000, 256, SlamSlots, Contours<'m>>;

/// The same without contours.
pub type SlamCapacities = CapacitiesOf<1440, 1000, 1000, 256>;

/// The room for everything, with maps that are lent for `'m`.
pub type LentCapacities<'m> = CapacitiesOf<1440, 1000, 1000, 256, SlamSlots, Contours<'m>, Lent<'m>>;

/// The same without contours and without a map in the state: [`super::Parameters::maps`] must not ask for one.
pub type VehicleCapacities = CapacitiesOf<1440, 1000, 1000, 256, NoSlots>;

/// The same with contours of a kept map.
pub type VehicleWithContours<'m> = CapacitiesOf<1440, 1000, 1000, 256, NoSlots, Contours<'m, 400, 6144, 0>>;

/// How much a localiser has room for, as the log of its vehicle states it. One of another size may answer differently.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct StatedCapacities {
    /// Landmarks of the fixed maps, reflectors and features together.
    pub landmarks: u32,
    /// Beams of a scan.
    pub beams: u32,
    /// Motions and corrections of the filter's past.
    pub history: u32,
    /// Points of the surroundings by a map of contours; none if it is 0.
    pub contours: u32,
}
