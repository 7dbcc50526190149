//! Where a planar laser is on a vehicle, by transforms in space: upright or upside down, but never tilted.

use std::f64::consts::PI;

use agv_core::geometry::Pose as PlanarPose;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

use crate::ros::messages::{Pose, Transforms};

/// Largest angle between the plane of the laser and that of the vehicle, rad: distances then err by 0.4 %.
const LARGEST_TILT: f64 = 5.0 * PI / 180.0;

/// Where a laser is, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mounting {
    /// Its pose on the vehicle; the heading is that of its first axis.
    pub pose: PlanarPose,
    /// Whether its bearings grow clockwise, seen from above.
    pub is_upside_down: bool,
}

/// Why transforms do not say where a laser is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MountingError {
    /// No chain of transforms leads from the vehicle to it.
    Unknown,
    /// Its plane is not that of the vehicle; by so much, rad.
    Tilted(f64),
}

/// Longest chain of transforms that is followed.
const CHAIN: usize = 32;

/// The name of a frame without the stroke that old recordings put before it.
pub fn plain(frame: &str) -> &str {
    frame.trim_start_matches('/')
}

/// Where the frame `laser` is in the frame `base`.
///
/// # Errors
/// See [`MountingError`].
pub fn find(transforms: &Transforms, base: &str, laser: &str) -> Result<Mounting, MountingError> {
    let (mut place, mut frame) = (Isometry3::identity(), plain(laser));
    for _ in 0..CHAIN {
        if frame == plain(base) {
            return in_plane(&place);
        }
        let step = transforms.transforms.iter().find(|step| plain(&step.child_frame_id) == frame);
        let step = step.ok_or(MountingError::Unknown)?;
        place = isometry(&step.transform) * place;
        frame = plain(&step.header.frame_id);
    }
    Err(MountingError::Unknown)
}

fn isometry(pose: &Pose) -> Isometry3<f64> {
    let (at, turn) = (pose.position, pose.orientation);
    let turn = Quaternion::new(turn.w, turn.x, turn.y, turn.z);
    // What was never filled in turns nothing.
    let turn = UnitQuaternion::try_new(turn, 1e-6).unwrap_or_else(UnitQuaternion::identity);
    Isometry3::from_parts(Translation3::new(at.x, at.y, at.z), turn)
}

fn in_plane(place: &Isometry3<f64>) -> Result<Mounting, MountingError> {
    let (ahead, up) = (place.rotation * Vector3::x(), place.rotation * Vector3::z());
    let tilt = up.x.hypot(up.y).atan2(up.z.abs());
    if tilt.is_nan() || tilt > LARGEST_TILT {
        return Err(MountingError::Tilted(tilt));
    }
    let at = place.translation.vector;
    Ok(Mounting { pose: PlanarPose::new(at.x, at.y, ahead.y.atan2(ahead.x)), is_upside_down: up.z < 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros::messages::{Header, Quaternion as Turn, TransformStamped, Vector};

    fn step(parent: &str, child: &str, [x, y]: [f64; 2], axis: [f64; 3], angle: f64) -> TransformStamped {
        let (sine, w) = (0.5 * angle).sin_cos();
        let orientation = Turn { x: sine * axis[0], y: sine * axis[1], z: sine * axis[2], w };
        TransformStamped {
            header: Header { frame_id: parent.to_owned(), ..Header::default() },
            child_frame_id: child.to_owned(),
            transform: Pose { position: Vector { x, y, z: 0.4 }, orientation },
        }
    }

    #[test]
    fn what_hangs_from_a_mast_is_where_its_transforms_lead() {
        // Turned by a quarter on the mast, then hung by a roll: the first axis keeps its direction.
        let chain = vec![
            step("/mast", "laser", [0.2, 0.0], [1.0, 0.0, 0.0], PI),
            step("base", "mast", [1.0, 0.5], [0.0, 0.0, 1.0], PI / 2.0),
        ];
        let found = find(&Transforms { transforms: chain.clone() }, "base", "/laser").unwrap();
        assert!(found.is_upside_down);
        assert!((found.pose.x - 1.0).abs() < 1e-12 && (found.pose.y - 0.7).abs() < 1e-12);
        assert!((found.pose.theta - PI / 2.0).abs() < 1e-12);
        // Hung by a pitch, the first axis looks back.
        let pitched = vec![step("base", "laser", [0.0, 0.0], [0.0, 1.0, 0.0], PI)];
        let found = find(&Transforms { transforms: pitched }, "base", "laser").unwrap();
        assert!(found.is_upside_down && (found.pose.theta.abs() - PI).abs() < 1e-12);
        assert_eq!(find(&Transforms { transforms: chain }, "wheel", "laser"), Err(MountingError::Unknown));
        let tilted = Transforms { transforms: vec![step("base", "laser", [0.0; 2], [1.0, 0.0, 0.0], 0.3)] };
        let Err(MountingError::Tilted(tilt)) = find(&tilted, "base", "laser") else { panic!() };
        assert!((tilt - 0.3).abs() < 1e-12);
    }
}
