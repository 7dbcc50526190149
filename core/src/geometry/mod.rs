//! Angles and planar poses.

mod angle;
mod pose;

pub use angle::{difference, wrap};
pub use pose::{Pose, Twist};

/// A point or a displacement in the plane, m.
pub type Point = nalgebra::Vector2<f64>;

/// A point of a scan or a feature, m, in single precision.
pub type ScanPoint = nalgebra::Vector2<f32>;
