//! Angles, sectors, planar poses and transforms, and the rigid fit of points to points.

mod angle;
mod axes;
mod pose;
mod rigid_fit;
mod sector;
mod transform;

pub use angle::{difference, wrap};
pub(crate) use axes::{larger_axis, length};
pub use pose::{Pose, Twist};
pub use rigid_fit::{RigidFit, fit_rigid};
pub use sector::sector;
pub use transform::Transform;

/// A point or a displacement in the plane, m.
pub type Point = nalgebra::Vector2<f64>;

/// A point of a scan or a feature, m, in single precision.
pub type ScanPoint = nalgebra::Vector2<f32>;
