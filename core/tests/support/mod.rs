//! A hall and a vehicle in it, whose truth is known to the tests.

pub mod hall;
pub mod kept_map;
pub mod reference_drive;
pub mod replaced;
pub mod stage;
pub mod standing_scan;
pub mod view;
pub mod walls;
