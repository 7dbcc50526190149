//! Finding oneself among reflectors that all look alike: only their distances tell them apart.

mod answer;
mod distance_histogram;
mod groups;
mod indexed_reflectors;
mod occupancy;
mod relocalizer;
mod snapshot;
mod sought_pairs;
mod squared_distance;

pub use answer::{ReflectorAnswer, ReflectorFix};
pub use indexed_reflectors::{IndexedReflectors, ReflectorIndex};
pub use relocalizer::{ReflectorRelocalizer, RelocalizationParameters, RelocalizationProgress};
pub use snapshot::{ReflectorNoise, ReflectorSnapshot, SeenReflector};
