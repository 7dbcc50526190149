//! What is said of the vehicle: its pose, what that rests on, and why.

mod landmark_use;
mod laser_health;
mod level_growth;
mod mode;
mod pose_output;
mod protection_level;
mod relocalization;

pub use landmark_use::{LandmarkSource, LandmarkUse};
pub use laser_health::LaserHealth;
pub use level_growth::LevelGrowth;
pub use mode::{Mode, Reason};
pub use pose_output::PoseOutput;
pub use protection_level::ProtectionLevel;
pub use relocalization::Relocalization;
