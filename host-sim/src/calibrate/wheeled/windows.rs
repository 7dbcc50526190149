//! Pieces of a drive between two of its poses.

use super::clock::Clock;
use super::drive::{TimedPose, WheelDrive};
use super::path::LinearisedPath;
use nalgebra::{DMatrix, DVector, Vector3};

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

/// What a window contributes: residuals, and their derivatives by the unknowns and by offset and rate of the clock.
pub struct Residual {
    /// What the wheels say less what the poses say: x, y, m, heading, rad; then what redundant wheels say differently, m.
    pub values: DVector<f64>,
    /// One row a value.
    pub by_unknowns: DMatrix<f64>,
    /// One row a value; offset, rate.
    pub by_clock: DMatrix<f64>,
}

impl Window {
    /// The residual of the window.
    pub fn residual(&self, path: &LinearisedPath, clock: &Clock) -> Residual {
        let (start, end) = (path.sensor_at(self.start.time, clock), path.sensor_at(self.end.time, clock));
        let (slip_start, slip_end) = (path.slip_at(self.start.time, clock), path.slip_at(self.end.time, clock));
        let said = between(&start.pose, &end.pose);
        let vector = |pose: &TimedPose| Vector3::new(pose.x, pose.y, pose.heading);
        let seen = between(&vector(&self.start), &vector(&self.end));
        let (sine, cosine) = start.pose.z.sin_cos();
        // Derivative of the displacement by the derivatives of its ends.
        let derive = |first: Vector3<f64>, second: Vector3<f64>| {
            let change = second - first;
            Vector3::new(
                cosine * change.x + sine * change.y + said.y * first.z,
                cosine * change.y - sine * change.x - said.x * first.z,
                change.z,
            )
        };
        let rows = 3 + slip_start.0.len();
        let mut residual = Residual {
            values: DVector::zeros(rows),
            by_unknowns: DMatrix::zeros(rows, start.by_unknowns.ncols()),
            by_clock: DMatrix::zeros(rows, 2),
        };
        residual.values.rows_mut(0, 3).copy_from(&(said - seen));
        residual.values.rows_mut(3, rows - 3).copy_from(&(slip_end.0 - slip_start.0));
        for column in 0..residual.by_unknowns.ncols() {
            let of =
                |matrix: &DMatrix<f64>| Vector3::new(matrix[(0, column)], matrix[(1, column)], matrix[(2, column)]);
            let derived = derive(of(&start.by_unknowns), of(&end.by_unknowns));
            residual.by_unknowns.view_mut((0, column), (3, 1)).copy_from(&derived);
        }
        residual.by_unknowns.rows_mut(3, rows - 3).copy_from(&(slip_end.1 - slip_start.1));
        // The later the odometry's clock says it, the earlier on it is the time that is asked for.
        for (column, [first, second]) in [[1.0, 1.0], [self.start.time, self.end.time]].into_iter().enumerate() {
            let derived = derive(-start.velocity * first, -end.velocity * second);
            residual.by_clock.view_mut((0, column), (3, 1)).copy_from(&derived);
            let slip = &slip_start.2 * first - &slip_end.2 * second;
            residual.by_clock.view_mut((3, column), (rows - 3, 1)).copy_from(&slip);
        }
        residual
    }
}
