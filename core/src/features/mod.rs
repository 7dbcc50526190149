//! Points that can be recognised in a scan.

pub mod falko;
mod keypoint;
mod point_scan;

pub use keypoint::{Keypoint, KeypointKind};
pub use point_scan::PointScan;
