//! The extended Kalman filter of the pose (K 5.3).

mod augmented;
mod augmented_observation;
mod cartesian;
mod consistency;
mod drift_check;
mod ekf;
mod motion_check;
mod observation;
mod packed_covariance;
mod positive_semidefinite;
mod range_bearing;
mod sparse_linearisation;
mod timeline;

pub use augmented::{Augmented, BiasDeviations, BiasWalk, augmented_states};
pub use augmented_observation::RelativePose;
pub use cartesian::Cartesian;
pub use consistency::{Consistency, ConsistencyParameters};
pub use drift_check::{DriftCheck, Suspect};
pub use ekf::{Ekf, Innovation};
pub use motion_check::MotionCheck;
pub use observation::{Linearisation, Observation};
pub use packed_covariance::{PackedCovariance, packed_entries};
pub use range_bearing::RangeBearing;
pub use sparse_linearisation::{SparseLinearisation, TERMS};
pub use timeline::{Correction, Timeline, TimelineError};
