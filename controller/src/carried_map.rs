//! What a controller says of its map.

use agv_core::maps::Landmark;
use agv_settings::map_identity;
use agv_wire::can::controller_node::CarriedMap;

/// What is said of a map of these landmarks.
#[must_use]
pub fn carried_map<'a>(landmarks: impl IntoIterator<Item = &'a Landmark> + Clone) -> CarriedMap {
    let count = landmarks.clone().into_iter().count();
    CarriedMap { identity: map_identity(landmarks), landmarks: count.try_into().unwrap_or(u16::MAX) }
}
