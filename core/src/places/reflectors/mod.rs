//! Finding oneself among reflectors that all look alike: only their distances tell them apart.

mod answer;
mod occupancy;
mod pair_index;
mod relocalizer;
mod snapshot;

pub use answer::{ReflectorAnswer, ReflectorFix};
pub use pair_index::{PairIndex, ReflectorIndex, ReflectorIndexError};
pub use relocalizer::{ReflectorRelocalizer, RelocalizationParameters, RelocalizationProgress};
pub use snapshot::{ReflectorNoise, ReflectorSnapshot, SeenReflector};
