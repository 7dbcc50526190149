//! The extended Kalman filter of the pose (K 5.3).

mod cartesian;
mod consistency;
mod ekf;
mod observation;
mod range_bearing;
mod timeline;

pub use cartesian::Cartesian;
pub use consistency::{Consistency, ConsistencyParameters};
pub use ekf::{Ekf, Innovation};
pub use observation::{Linearisation, Observation};
pub use range_bearing::RangeBearing;
pub use timeline::{Correction, Timeline, TimelineError};
