//! Files for other programs.

pub mod candump;
pub mod keypoints;
