//! Points that can be recognised in a scan.

mod binary_shape_context;
mod cumulative_gaussian_histogram;
pub mod falko;
mod keypoint;
pub(crate) mod line;
mod motion_correction;
mod neighbourhood;
mod orthogonal_corners;
mod point_scan;
mod reflector_detection;

pub use binary_shape_context::BinaryShapeContext;
pub use cumulative_gaussian_histogram::{CumulativeGaussianHistogram, Kernel};
pub use keypoint::{Keypoint, KeypointKind};
pub use motion_correction::SensorPath;
pub use orthogonal_corners::{HoughSpectrum, OrthogonalCornerParameters, OrthogonalCorners};
pub use point_scan::PointScan;
pub use reflector_detection::{ReflectorDetection, detect_reflectors};
