//! Qualitative localisation: has this place been seen (M chapter 5)?

#[cfg(feature = "std")]
mod agreement;
#[cfg(feature = "std")]
mod alignment;
mod arctangent;
mod enriched;
mod facing;
mod floor;
#[cfg(feature = "std")]
mod floor_plan;
mod histogram;
mod image;
mod key_signatures;
mod levelled;
#[cfg(feature = "std")]
mod look_alikes;
mod loop_closure;
mod normals;
mod orientation;
mod panorama;
mod plane_fit;
#[cfg(feature = "std")]
mod pose;
#[cfg(feature = "std")]
mod recognition;
#[cfg(feature = "std")]
mod refinement;
mod ring_key;
mod solved;
mod threshold;

#[cfg(feature = "std")]
pub use agreement::Agreement;
#[cfg(feature = "std")]
pub use alignment::{Alignment, Asked, Stored};
pub use enriched::{ENRICHED_LENGTH, Enriched};
pub use facing::{Facing, relative_turn};
pub use floor::Floor;
pub use histogram::{BINS, Histogram, chi_square, normalised_chi_square, normalised_sorensen, sorensen};
pub use image::{AskedImage, Likeness, PlaceImage, RINGS, SECTORS};
pub use key_signatures::KeySignatures;
pub use loop_closure::{Limits, loop_closure};
pub use normals::{Neighbours, surfaces, vertical_parts};
pub use orientation::{DIRECTIONS, Orientation};
pub use panorama::{Panorama, Span};
pub use plane_fit::fitted_surfaces;
#[cfg(feature = "std")]
pub use pose::Pose;
#[cfg(feature = "std")]
pub use recognition::{Answer, Earlier, Place, PlaceIndex, Query};
pub use ring_key::{AskedKey, RingKey};
pub use threshold::from_key_scans;
