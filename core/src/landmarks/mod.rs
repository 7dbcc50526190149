//! Points of the world that the vehicle can recognise.

mod landmark;

pub use landmark::{Landmark, LandmarkKind};
