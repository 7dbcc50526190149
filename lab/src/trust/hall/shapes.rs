//! What halls are made of.

use agv_core::geometry::Pose;
use agv_host_sim::simulate::scenario::{RectangleOptions, ReflectorShape, Shapes};

/// From a surface to the axis of a reflector on it, m.
pub(super) const PROUD: f64 = 0.06;
/// A flat reflector is seen from within this of the direction that it faces, deg.
const FLAT: f64 = 45.0;

/// Adds a round reflector.
pub(super) fn add(shapes: &mut Shapes, x: f64, y: f64) {
    shapes.reflectors.push(ReflectorShape {
        x,
        y,
        radius: 0.04,
        farthest: 30.0,
        facing_deg: None,
        half_width_deg: 60.0,
    });
}

/// Adds one that is seen from in front of it only.
pub(super) fn add_flat(shapes: &mut Shapes, x: f64, y: f64, facing_deg: f64) {
    add(shapes, x, y);
    if let Some(added) = shapes.reflectors.last_mut() {
        *added = ReflectorShape { facing_deg: Some(facing_deg), half_width_deg: FLAT, ..*added };
    }
}

/// Adds a box about a pose.
pub(super) fn add_box(shapes: &mut Shapes, pose: Pose, length: f64, width: f64) {
    let heading_deg = pose.theta.to_degrees();
    shapes.rectangles.push(RectangleOptions { x: pose.x, y: pose.y, heading_deg, length, width });
}
