//! Points that can be recognised in a scan.

pub mod falko;
mod keypoint;
mod motion_correction;
mod point_scan;
mod reflector_detection;

pub use keypoint::{Keypoint, KeypointKind};
pub use motion_correction::SensorPath;
pub use point_scan::PointScan;
pub use reflector_detection::{ReflectorDetection, detect_reflectors};
