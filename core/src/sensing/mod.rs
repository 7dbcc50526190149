//! What is made of a scan: its points at the places from which they were seen, reflectors, keypoints, surfaces.

pub mod falko;
mod keypoint;
mod line;
mod motion_correction;
mod neighbourhood;
mod point_scan;
mod point_to_line;
mod reflector_detection;
mod surface_alignment;
mod surface_scan;

pub use keypoint::{Keypoint, KeypointKind};
pub(crate) use line::Moments;
pub use motion_correction::SensorPath;
pub use neighbourhood::visit_around;
pub use point_scan::{PointScan, PointView};
pub use point_to_line::PointToLine;
pub use reflector_detection::{ReflectorDetection, detect_reflectors};
pub use surface_alignment::{ScanAlignment, SurfaceAlignmentParameters, align_to_surfaces};
pub use surface_scan::{Surface, SurfaceParameters, SurfaceScan};
