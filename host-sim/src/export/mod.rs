//! Files for other programs.

pub mod answered;
pub mod candump;
pub mod csv;
pub mod keypoints;
pub mod mcap;
pub mod point_cloud;
pub mod rosbag2;
pub mod tum;
pub mod velodyne;
