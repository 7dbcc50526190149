//! What is said of the vehicle: its pose, what that rests on, and why.

mod mode;
mod pose_output;

pub use mode::{Mode, Reason};
pub use pose_output::PoseOutput;
