//! Files for other programs.

pub mod candump;
pub mod keypoints;
pub mod point_cloud;
pub mod velodyne;
