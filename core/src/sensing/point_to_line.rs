//! By how far a pose must be moved so that the points of a scan lie on lines.

use nalgebra::{Matrix3, Vector3};

use crate::geometry::{Pose, ScanPoint, wrap};

/// The normal equations of points that lie on lines, in the frame of the lines.
#[derive(Clone, Copy, Debug, Default)]
pub struct PointToLine {
    /// Inverse of the covariance of the pose (x, y, theta), if the weights are inverse variances.
    pub information: Matrix3<f64>,
    gradient: Vector3<f64>,
}

impl PointToLine {
    /// Adds a point at `distance` (m) from a line with the unit `normal`. `lever` is where the point is from the source's own
    /// position, m, so that heading and position hardly mix.
    #[inline]
    pub fn add(&mut self, normal: &ScanPoint, lever: &ScanPoint, distance: f32, weight: f32) {
        let row = Vector3::new(normal.x, normal.y, lever.x * normal.y - lever.y * normal.x).cast::<f64>();
        let weighted = row * f64::from(weight);
        self.information += weighted * row.transpose();
        self.gradient += weighted * f64::from(distance);
    }

    /// The pose after one step of Gauss and Newton. None if the points do not fix it.
    #[must_use]
    pub fn step(&self, pose: &Pose) -> Option<Pose> {
        let step = self.information.cholesky()?.solve(&self.gradient);
        Some(Pose { x: pose.x - step.x, y: pose.y - step.y, theta: wrap(pose.theta - step.z) })
    }
}
