//! How far dead reckoning is from poses that were measured.

use nalgebra::Vector3;
use serde::Serialize;

use super::clock::Clock;
use super::drive::WheelDrive;
use super::path::LinearisedPath;
use super::unknowns::WheeledModel;

/// Errors of a drive that was started in its first measured pose, without any alignment.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TrajectoryError {
    /// Position at the end, m.
    pub end_m: f64,
    /// Root of the mean square of the position over the drive, m.
    pub ate_m: f64,
    /// Heading at the end, degrees, not negative.
    pub end_heading_deg: f64,
}

impl TrajectoryError {
    /// Of that drive with those parameters, read by that clock. None if there are no poses, or the wheels do not determine the motion.
    #[must_use]
    pub fn of(drive: &WheelDrive, model: &WheeledModel, clock: &Clock) -> Option<Self> {
        let path = LinearisedPath::new(drive, model, &[])?;
        let first = drive.poses.first()?;
        let start = path.sensor_at(first.time, clock).pose;
        let turn = first.heading - start.z;
        let (sine, cosine) = turn.sin_cos();
        let (mut squares, mut last) = (0.0, Vector3::zeros());
        for pose in &drive.poses {
            let said = path.sensor_at(pose.time, clock).pose - start;
            let x = first.x + cosine * said.x - sine * said.y - pose.x;
            let y = first.y + sine * said.x + cosine * said.y - pose.y;
            last = Vector3::new(x, y, first.heading + said.z - pose.heading);
            squares += x * x + y * y;
        }
        Some(Self {
            end_m: last.x.hypot(last.y),
            ate_m: (squares / drive.poses.len() as f64).sqrt(),
            end_heading_deg: last.z.abs().to_degrees(),
        })
    }
}
