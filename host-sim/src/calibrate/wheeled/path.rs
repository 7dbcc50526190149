//! Where the wheels say that the sensor is, with derivatives by all unknowns.

use agv_core::odometry::{Integration, OdometryNoise, WheelMotion, WheelParameter, WheelPath, WheelSet};
use nalgebra::{DMatrix, DVector, Vector3};

use super::clock::Clock;
use super::drive::{WheelDrive, WheelStep};
use super::unknowns::{Moves, Unknown, WheeledModel};

/// x and y, m, and heading without jumps, rad, in the first pose of R; columns: the unknowns.
#[derive(Clone, Debug)]
pub struct Linearised {
    /// The pose.
    pub pose: Vector3<f64>,
    /// Its derivative by each unknown.
    pub by_unknowns: DMatrix<f64>,
    /// Its velocity, for each second of the odometry's clock.
    pub velocity: Vector3<f64>,
}

/// R at the end of each step.
#[derive(Clone, Debug)]
pub struct LinearisedPath {
    times: Vec<f64>,
    poses: Vec<Vector3<f64>>,
    /// Three rows each.
    derivatives: Vec<DMatrix<f64>>,
    /// What redundant wheels have said differently since the start, two numbers a wheel, m, and its derivatives; empty without them.
    slips: Vec<(DVector<f64>, DMatrix<f64>)>,
    sensor: agv_core::geometry::Pose,
    sensor_columns: [Option<usize>; 3],
}

/// Only the relation between both slips weighs: redundant wheels are believed alike.
const NOISE: OdometryNoise = OdometryNoise {
    turn: 0.0,
    speed: 0.0,
    steering: 0.0,
    slip: 1e-3,
    side_slip: 1e-3,
    yaw: 0.0,
    unknown_acceleration: 1.0,
    unknown_turn: 1.0,
};

/// What one step adds, and its derivatives by the unknowns.
struct Added {
    displacement: Vector3<f64>,
    by_unknowns: DMatrix<f64>,
    slip: DVector<f64>,
    slip_by_unknowns: DMatrix<f64>,
}

/// None if the wheels do not determine the step.
fn step(model: &WheeledModel, motions: &[WheelMotion], unknowns: &[Unknown], is_redundant: bool) -> Option<Added> {
    let set = WheelSet::of(&model.wheels);
    let path = WheelPath::new(&set, motions, &NOISE, Integration::Arc)?;
    let end = path.displacement();
    let slips = if is_redundant { model.wheels.len() } else { 0 };
    let mut added = Added {
        // A step turns by less than half a turn.
        displacement: Vector3::new(end.x, end.y, end.theta),
        by_unknowns: DMatrix::zeros(3, unknowns.len()),
        slip: DVector::from_iterator(2 * slips, (0..slips).flat_map(|wheel| path.slip(wheel))),
        slip_by_unknowns: DMatrix::zeros(2 * slips, unknowns.len()),
    };
    if motions.iter().all(|motion| motion.turn == 0.0) {
        return Some(added);
    }
    for (column, unknown) in unknowns.iter().enumerate() {
        let Moves::Wheels(moves) = &unknown.moves else { continue };
        for (wheel, parameter, factor) in moves {
            let share = factor / base(model, *wheel, *parameter);
            let mut place = added.by_unknowns.column_mut(column);
            place += share * path.derivative(*wheel, *parameter);
            for slipping in 0..slips {
                for (axis, change) in path.slip_derivative(slipping, *wheel, *parameter).into_iter().enumerate() {
                    added.slip_by_unknowns[(2 * slipping + axis, column)] += share * change;
                }
            }
        }
    }
    Some(added)
}

/// Whether there is a motion of those wheels in which they contradict each other.
pub fn is_redundant(model: &WheeledModel) -> bool {
    let motion = |number: usize| {
        let steering = 0.1 * (number + 1) as f64;
        WheelMotion { turn: 1.0 / (number + 1) as f64, steering_start: steering, steering_end: steering }
    };
    let motions: Vec<WheelMotion> = (0..model.wheels.len()).map(motion).collect();
    let set = WheelSet::of(&model.wheels);
    WheelPath::new(&set, &motions, &NOISE, Integration::Arc).is_some_and(|path| path.fit().slip > 1e-9)
}

/// A ratio is changed as a share of what it is now.
fn base(model: &WheeledModel, wheel: usize, parameter: WheelParameter) -> f64 {
    let ratio = model.wheels[wheel].steering.map_or(1.0, |encoder| encoder.scale);
    if parameter == WheelParameter::SteeringRatio { ratio } else { 1.0 }
}

impl LinearisedPath {
    /// Follows the wheels of a drive. None if they do not determine the motion.
    #[must_use]
    pub fn new(drive: &WheelDrive, model: &WheeledModel, unknowns: &[Unknown]) -> Option<Self> {
        let column = |axis: usize| unknowns.iter().position(|unknown| unknown.moves == Moves::Sensor(axis));
        let mut path = Self {
            times: vec![0.0],
            poses: vec![Vector3::zeros()],
            derivatives: vec![DMatrix::zeros(3, unknowns.len())],
            slips: Vec::new(),
            sensor: model.sensor,
            sensor_columns: [column(0), column(1), column(2)],
        };
        let (mut pose, mut derivative) = (Vector3::zeros(), DMatrix::zeros(3, unknowns.len()));
        let is_redundant = is_redundant(model);
        let rows = if is_redundant { 2 * model.wheels.len() } else { 0 };
        let mut slip = (DVector::zeros(rows), DMatrix::zeros(rows, unknowns.len()));
        path.slips.push(slip.clone());
        for WheelStep { end, motions } in scaled(drive, model) {
            let added = step(model, &motions, unknowns, is_redundant)?;
            (pose, derivative) = composed(&pose, &derivative, &added.displacement, &added.by_unknowns);
            slip.0 += added.slip;
            slip.1 += added.slip_by_unknowns;
            path.slips.push(slip.clone());
            path.times.push(end);
            path.poses.push(pose);
            path.derivatives.push(derivative.clone());
        }
        Some(path)
    }

    /// Where a time of the odometry's clock lies: before it, behind it, and the share of the way; the ends for a time outside.
    fn place(&self, time: f64) -> (usize, usize, f64) {
        let after = self.times.partition_point(|end| *end <= time);
        if after == 0 || after == self.times.len() {
            let end = after.saturating_sub(1);
            return (end, end, 0.0);
        }
        let (before, duration) = (after - 1, self.times[after] - self.times[after - 1]);
        (before, after, (time - self.times[before]) / duration)
    }

    /// What redundant wheels have said differently until a time of the poses' clock, m, with its derivatives by the unknowns and by
    /// time.
    #[must_use]
    pub fn slip_at(&self, time: f64, clock: &Clock) -> (DVector<f64>, DMatrix<f64>, DVector<f64>) {
        let (before, after, share) = self.place(clock.odometry_time(time));
        let ((first, first_by), (second, second_by)) = (&self.slips[before], &self.slips[after]);
        let duration = self.times[after] - self.times[before];
        let rate = if duration > 0.0 { (second - first) / duration } else { DVector::zeros(first.len()) };
        (first * (1.0 - share) + second * share, first_by * (1.0 - share) + second_by * share, rate)
    }

    /// R between two steps, at constant velocity; it stands before the first and behind the last one.
    fn robot_at(&self, time: f64) -> Linearised {
        let (before, after, share) = self.place(time);
        if before == after {
            let by_unknowns = self.derivatives[before].clone();
            return Linearised { pose: self.poses[before], by_unknowns, velocity: Vector3::zeros() };
        }
        let duration = self.times[after] - self.times[before];
        let change = self.poses[after] - self.poses[before];
        Linearised {
            pose: self.poses[before] + share * change,
            by_unknowns: &self.derivatives[before] * (1.0 - share) + &self.derivatives[after] * share,
            velocity: change / duration,
        }
    }

    /// The sensor at a time of the poses' clock, s.
    #[must_use]
    pub fn sensor_at(&self, time: f64, clock: &Clock) -> Linearised {
        let mut robot = self.robot_at(clock.odometry_time(time));
        let (sine, cosine) = robot.pose.z.sin_cos();
        let arm = Vector3::new(
            cosine * self.sensor.x - sine * self.sensor.y,
            sine * self.sensor.x + cosine * self.sensor.y,
            self.sensor.theta,
        );
        let turned = robot.by_unknowns.row(2).clone_owned();
        let across = [-arm.y, arm.x];
        for (row, across) in across.into_iter().enumerate() {
            let mut place = robot.by_unknowns.row_mut(row);
            place += across * &turned;
        }
        let columns = [[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]];
        for (column, values) in self.sensor_columns.iter().zip(columns) {
            if let Some(column) = column {
                let mut place = robot.by_unknowns.column_mut(*column);
                place += DVector::from_column_slice(&values);
            }
        }
        robot.velocity += Vector3::new(-arm.y, arm.x, 0.0) * robot.velocity.z;
        robot.pose += arm;
        robot
    }
}

/// The steps of a drive as the model's steering encoders say them: their scale is a ratio of the nominal angle.
fn scaled<'a>(drive: &'a WheelDrive, model: &'a WheeledModel) -> impl Iterator<Item = WheelStep> + 'a {
    drive.steps.iter().map(|step| {
        let ratio = |wheel: usize| model.wheels[wheel].steering.map_or(1.0, |encoder| encoder.scale);
        let motions = step.motions.iter().enumerate().map(|(wheel, motion)| WheelMotion {
            turn: motion.turn,
            steering_start: ratio(wheel) * motion.steering_start,
            steering_end: ratio(wheel) * motion.steering_end,
        });
        WheelStep { end: step.end, motions: motions.collect() }
    })
}

fn composed(
    pose: &Vector3<f64>,
    derivative: &DMatrix<f64>,
    moved: &Vector3<f64>,
    by_unknowns: &DMatrix<f64>,
) -> (Vector3<f64>, DMatrix<f64>) {
    let (sine, cosine) = pose.z.sin_cos();
    let turned = Vector3::new(cosine * moved.x - sine * moved.y, sine * moved.x + cosine * moved.y, moved.z);
    let mut next = derivative.clone();
    for column in 0..derivative.ncols() {
        let [x, y, heading] = [0, 1, 2].map(|row| by_unknowns[(row, column)]);
        let by_heading = derivative[(2, column)];
        next[(0, column)] += cosine * x - sine * y - turned.y * by_heading;
        next[(1, column)] += sine * x + cosine * y + turned.x * by_heading;
        next[(2, column)] += heading;
    }
    (pose + turned, next)
}
