//! How much this image localises with.

use agv_core::localizer;

/// Whether the localiser has room for landmarks in its state, without which `maps.slam` cannot be switched on.
pub const HAS_SLAM: bool = cfg!(feature = "slam");

/// What the localiser of this image has room for.
#[cfg(feature = "slam")]
type Capacities = localizer::SlamCapacities;
#[cfg(not(feature = "slam"))]
type Capacities = localizer::VehicleCapacities;

/// The localiser of this image.
pub type Localizer = localizer::Localizer<Capacities>;
