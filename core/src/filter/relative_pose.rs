//! A past place of the first laser, seen from the present one.

use nalgebra::{Matrix3, Vector3};

use super::biases::YAW;
use super::slots::{Slots, pose_state};
use super::viewpoint::{Viewpoint, left};
use super::{Ekf, Linearisation};
use crate::geometry::{Point, Pose, difference};
use crate::measurement::LaserId;

/// Pose of S relative to a past one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativePose {
    /// Pose of S in the past S.
    pub pose: Pose,
    /// Covariance of x, y (m) and heading (rad), in the past S.
    pub covariance: Matrix3<f64>,
}

impl<S: Slots> Ekf<S> {
    /// Pose of S relative to where it was at a past pose, as it is expected. None if that pose is not remembered.
    #[must_use]
    pub fn expected_relative_pose(&self, slot: usize, mount: &Pose) -> Option<Pose> {
        let past = self.past_pose(slot)?;
        let mounted = Pose::new(mount.x, mount.y, mount.theta + self.laser_yaw());
        Some(past.compose(&mounted).between(&self.pose.compose(&mounted)))
    }

    /// Compares the place of S relative to a past one with what is expected. None if that pose is not remembered.
    #[must_use]
    pub fn observe_relative_pose(&self, slot: usize, seen: &RelativePose, mount: &Pose) -> Option<Linearisation<3>> {
        let expected = self.expected_relative_pose(slot, mount)?;
        let past = self.poses.as_ref().get(slot).copied().flatten()?;
        let (now, then) = (
            self.viewpoint(LaserId::FIRST, mount),
            Viewpoint::new(&past.pose, past.anchor, mount, Some(self.laser_yaw())),
        );
        let residual = Vector3::new(
            seen.pose.x - expected.x,
            seen.pose.y - expected.y,
            difference(seen.pose.theta, expected.theta),
        );
        let shift = |vector: &Point| {
            let inwards = then.inwards(vector);
            Vector3::new(inwards.x, inwards.y, 0.0)
        };
        let turn = Vector3::new(0.0, 0.0, 1.0);
        let from_past = now.anchor + now.arm - past.anchor;
        let state = pose_state(slot);
        let mut linearisation = Linearisation::new(residual, seen.covariance);
        for (axis, direction) in [Point::new(1.0, 0.0), Point::new(0.0, 1.0)].iter().enumerate() {
            linearisation.add(axis, shift(direction));
            linearisation.add(state + axis, -shift(direction));
        }
        Some(
            linearisation
                .with(2, shift(&left(&now.arm)) + turn)
                .with(state + 2, -shift(&left(&from_past)) - turn)
                .with(YAW, -shift(&left(&(from_past - then.arm)))),
        )
    }
}
