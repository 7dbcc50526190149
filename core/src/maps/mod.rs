//! Points of the world that the vehicle can recognise.

mod association;
mod dynamic_map;
mod fixed_map;
mod grid;
mod landmark;
mod lent_map;

pub use association::{Match, NearestNeighbour, Verdict};
pub use dynamic_map::{DynamicLandmark, DynamicMap, DynamicMapParameters, DynamicMapView};
pub use fixed_map::{FixedMap, MapError, MapView};
pub use grid::{Grid, GridView};
pub use landmark::{Landmark, LandmarkKind, put_reflectors_first};
pub use lent_map::{LendError, LentMap};
