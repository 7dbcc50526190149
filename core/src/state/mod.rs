//! What is said of the vehicle: its pose, what that rests on, and why.

mod mode;
mod pose_output;
mod protection_level;

pub use mode::{Mode, Reason};
pub use pose_output::PoseOutput;
pub use protection_level::ProtectionLevel;
