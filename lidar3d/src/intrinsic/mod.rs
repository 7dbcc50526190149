//! Intrinsic calibration from scans of planes (M chapter 3).
//!
//! A plane is scanned from many distances and at many tilts. [`segment`] finds it in each scan; [`calibrate`] then
//! moves D_corr, theta, alpha and the offsets of all lasers, and every plane, until the points lie on their planes.

mod adjustment;
mod found;
mod normal_equations;
mod plane;
mod scan;
mod segmentation;
mod sight;

pub use adjustment::{AdjustmentError, Residual, calibrate, calibrate_near};
pub use found::{Adjustment, Deviation, Held};
pub use plane::Plane;
pub use scan::{Flatness, Return, Target, flatness};
pub use segmentation::{SegmentationError, segment};
