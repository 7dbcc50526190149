//! Multi-beam lidars: where their packets come from, and whole revolutions of points.

#[cfg(all(feature = "bags", feature = "point-clouds"))]
pub mod bag_clouds;
#[cfg(not(all(feature = "bags", feature = "point-clouds")))]
#[path = "no_bag_clouds.rs"]
pub mod bag_clouds;
pub mod capture;
pub mod cloud_speed;
pub mod clouds;
pub mod decoder;
pub mod kind;
pub mod live;
#[cfg(all(feature = "bags", feature = "point-clouds"))]
pub mod live_clouds;
#[cfg(not(all(feature = "bags", feature = "point-clouds")))]
#[path = "no_live_clouds.rs"]
pub mod live_clouds;
pub mod mount;
pub mod open_source;
pub mod place_map;
pub mod place_search;
#[cfg(all(feature = "bags", feature = "point-clouds"))]
pub mod point_cloud2;
pub mod projection;
pub mod refinement;
pub mod revolution;
pub mod ring_surfaces;
pub mod scan_motion;
pub mod setup;
mod setup_options;
pub mod signatures;
pub mod source;
pub mod source_error;
pub mod spinning_lidar;
pub mod stand;
pub mod survey;
pub mod view;
pub mod wall_points;

pub use open_source::OpenSource;
pub use revolution::{Revolution, Revolutions};
pub use setup::Setup;
pub use setup_options::{SetupError, SetupOptions};
pub use source::Source;
pub use source_error::SourceError;
pub use survey::Survey;
