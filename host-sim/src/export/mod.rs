//! Files for other programs.

pub mod keypoints;
