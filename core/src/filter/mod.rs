//! The extended Kalman filter of the pose (K 5.3).

mod augmented;
mod augmented_observation;
mod cartesian;
mod ekf;
mod observation;
mod packed_covariance;
mod positive_semidefinite;
mod range_bearing;
mod sparse_linearisation;
mod timeline;

pub use augmented::{Augmented, BiasDeviations, BiasWalk, augmented_states};
pub use augmented_observation::RelativePose;
pub use cartesian::Cartesian;
pub use ekf::{Ekf, Innovation};
pub use observation::{Linearisation, Observation};
pub use packed_covariance::{PackedCovariance, packed_entries};
pub use range_bearing::RangeBearing;
pub use sparse_linearisation::{SparseLinearisation, TERMS};
pub use timeline::{Correction, Timeline, TimelineError};
