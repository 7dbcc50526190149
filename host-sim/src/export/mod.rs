//! Files for other programs.

pub mod answered;
pub mod candump;
pub mod csv;
pub mod eds;
pub mod keypoints;
#[cfg(feature = "bags")]
pub mod mcap;
pub mod point_cloud;
#[cfg(feature = "bags")]
pub mod rosbag2;
pub mod tum;
pub mod velodyne;
