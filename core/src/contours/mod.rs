//! Localising by contours: surfaces of the distance behind, or of a map, that scans are matched to.
//!
//! A scan becomes points of surfaces ([`find_surface_points`]); those of the last key scans ([`KeyRing`]) make a map of the
//! surroundings ([`Submap`]) in which a scan is first looked for ([`search`]) and then laid onto the surfaces ([`refine`]).

mod contour_length;
mod correlative_search;
mod kept_map;
mod kept_point;
mod key_ring;
mod likelihood_grid;
mod matcher;
mod place_search;
mod prediction;
mod refinement;
mod submap;
mod surface_point;
mod surface_points;
mod surroundings;
mod tile;

pub use correlative_search::{SearchResult, SearchWindow, search};
pub use kept_map::{KeptMap, KeptMapError};
pub use kept_point::KeptPoint;
pub use key_ring::{KeyRing, KeyScan};
pub use likelihood_grid::LikelihoodGrid;
pub use matcher::{ContourMatch, ContourMatcher, align, align_nearby};
pub use place_search::best_places::{PlaceAnswer, PlaceFix};
pub use place_search::{PlaceProgress, PlaceSearch};
pub use prediction::Prediction;
pub use refinement::{Refinement, refine};
pub use submap::{LARGEST_REACH, Submap};
pub use surface_point::{PackedPoint, SurfacePoint};
pub use surface_points::find_surface_points;
pub use surroundings::Surroundings;
pub use tile::{TILE, Tile};
