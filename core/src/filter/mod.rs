//! The extended Kalman filter (K 5.3): one for all modes, with room for as much as a vehicle needs.

mod biases;
mod cartesian;
mod cholesky;
mod ekf;
mod gyro_state;
mod linearisation;
mod observation;
mod packed_covariance;
mod pose_observation;
mod positive_semidefinite;
mod range_bearing;
mod relative_pose;
mod slot_states;
mod slots;
mod timeline;
mod viewpoint;

pub use biases::{BiasDeviations, BiasModel, BiasWalk};
pub use cartesian::Cartesian;
pub use ekf::{Ekf, Innovation, Landmark};
pub use gyro_state::{GyroState, KnownPose};
pub use linearisation::{Linearisation, TERMS};
pub use observation::Observation;
pub use packed_covariance::PackedCovariance;
pub use pose_observation::PoseObservation;
pub use range_bearing::RangeBearing;
pub use relative_pose::RelativePose;
pub(crate) use slots::storage;
pub use slots::{Empty, PoseAndSlots, PoseOnly, Slots, Storage, packed_entries, slot_states};
pub use timeline::{Correction, Timeline, TimelineError};
pub use viewpoint::Viewpoint;
