//! Pieces of a drive between two of its poses.

use super::clock::Clock;
use super::drive::{TimedPose, WheelDrive};
use super::path::LinearisedPath;
use nalgebra::{DMatrix, Vector3};

/// Length of a window, s: long enough that counters which stall and catch up do not matter, short enough that nothing adds up.
pub const SECONDS: f64 = 2.0;
/// Windows begin so far apart, s.
pub const STRIDE: f64 = 0.5;
/// Windows of which a common cause may disturb several, s: what the odometry does wrongly lasts that long at most.
pub const MEMORY: f64 = 10.0;

/// A window between two poses of a drive.
#[derive(Clone, Copy, Debug)]
pub struct Window {
    /// The drive.
    pub drive: usize,
    /// The pose in which it begins.
    pub start: TimedPose,
    /// The pose in which it ends.
    pub end: TimedPose,
}

/// All windows of a drive.
pub fn of(number: usize, drive: &WheelDrive) -> Vec<Window> {
    let poses = &drive.poses;
    let (Some(first), Some(last)) = (poses.first(), poses.last()) else { return Vec::new() };
    let count = ((last.time - first.time - SECONDS) / STRIDE).floor();
    let at = |time: f64| poses.partition_point(|pose| pose.time < time - 1e-9).min(poses.len() - 1);
    let window = |index: usize| {
        let begin = first.time + index as f64 * STRIDE;
        let (start, end) = (poses[at(begin)], poses[at(begin + SECONDS)]);
        // A gap in the poses makes windows of other lengths.
        let length = end.time - start.time;
        (0.5 * SECONDS..=1.5 * SECONDS).contains(&length).then_some(Window { drive: number, start, end })
    };
    if count < 0.0 { Vec::new() } else { (0..=count as usize).filter_map(window).collect() }
}

/// Displacement from the first to the second pose, in the first one.
fn between(first: &Vector3<f64>, second: &Vector3<f64>) -> Vector3<f64> {
    let (sine, cosine) = first.z.sin_cos();
    let change = second - first;
    Vector3::new(cosine * change.x + sine * change.y, cosine * change.y - sine * change.x, change.z)
}

impl Window {
    /// What the wheels say less what the poses say: x, y, m, heading, rad; its derivatives by the unknowns, and by offset and rate of
    /// the clock.
    pub fn residual(&self, path: &LinearisedPath, clock: &Clock) -> (Vector3<f64>, DMatrix<f64>, [Vector3<f64>; 2]) {
        let (start, end) = (path.sensor_at(self.start.time, clock), path.sensor_at(self.end.time, clock));
        let said = between(&start.pose, &end.pose);
        let vector = |pose: &TimedPose| Vector3::new(pose.x, pose.y, pose.heading);
        let seen = between(&vector(&self.start), &vector(&self.end));
        let (sine, cosine) = start.pose.z.sin_cos();
        // Derivative of the displacement by the derivatives of its ends.
        let derive = |first: [f64; 3], second: [f64; 3]| {
            let change = [second[0] - first[0], second[1] - first[1], second[2] - first[2]];
            Vector3::new(
                cosine * change[0] + sine * change[1] + said.y * first[2],
                cosine * change[1] - sine * change[0] - said.x * first[2],
                change[2],
            )
        };
        let mut by_unknowns = DMatrix::zeros(3, start.by_unknowns.ncols());
        for column in 0..by_unknowns.ncols() {
            let of = |matrix: &DMatrix<f64>| [matrix[(0, column)], matrix[(1, column)], matrix[(2, column)]];
            by_unknowns.set_column(column, &derive(of(&start.by_unknowns), of(&end.by_unknowns)));
        }
        let moved = |velocity: &Vector3<f64>, by: f64| [velocity.x * by, velocity.y * by, velocity.z * by];
        let by_offset = derive(moved(&start.velocity, -1.0), moved(&end.velocity, -1.0));
        let by_rate = derive(moved(&start.velocity, -self.start.time), moved(&end.velocity, -self.end.time));
        (said - seen, by_unknowns, [by_offset, by_rate])
    }
}
