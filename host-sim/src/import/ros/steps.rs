//! What odometry of ROS 2 says of the motion: the differences of its poses, or its speeds where the poses say nothing.

use agv_core::geometry::{Pose, Twist};
use agv_core::measurement::{PoseIncrement, Time};

use crate::account::Account;
use crate::ros::messages::{Odometry, Quaternion};

/// Poses that move by less than this share of what the speeds say are not filled in.
const SHARE: f64 = 0.05;
/// Speeds that amount to less than this say nothing either, m or rad.
const LEAST: f64 = 0.05;
/// Length of a quaternion that turns nothing.
const NOTHING: f64 = 1e-6;
/// An orientation is a unit quaternion, but for roundings.
const UNIT: f64 = 0.01;
/// A pose that jumps by more where the clock starts again is that of another run, m.
const JUMP: f64 = 0.5;

/// A message and its time.
pub(super) struct TimedOdometry<'a> {
    /// When it was true.
    pub(super) time: Time,
    /// What was said.
    pub(super) message: &'a Odometry,
    /// Whether the clock started again with it.
    pub(super) is_restart: bool,
}

/// Whether an orientation is one.
pub(super) fn is_orientation(turn: &Quaternion) -> bool {
    let Quaternion { x, y, z, w } = *turn;
    let length = (x * x + y * y + z * z + w * w).sqrt();
    (length - 1.0).abs() < UNIT
}

fn is_empty(turn: &Quaternion) -> bool {
    [turn.x, turn.y, turn.z, turn.w].iter().all(|part| part.abs() < NOTHING)
}

/// The motion between each message and the one before; None for a message that cannot be used.
pub(super) fn increments(messages: &[TimedOdometry], account: &mut Account) -> Vec<Option<PoseIncrement>> {
    let poses: Vec<Option<Pose>> = messages.iter().map(|one| pose(one.message)).collect();
    let twists: Vec<Twist> = messages.iter().map(|one| twist(one.message)).collect();
    let by_speeds: Vec<Pose> = (0..messages.len()).map(|index| step_of_speeds(messages, &twists, index)).collect();
    let size = |pose: &Pose| pose.position().norm() + pose.theta.abs();
    let spoken: f64 = by_speeds.iter().map(size).sum();
    let shown: f64 = steps(&poses).iter().flatten().map(size).sum();
    if spoken > LEAST && shown < SHARE * spoken {
        account.note("the poses of the odometry do not move: its speeds were added up");
        account.take(messages.len());
        let increment = |(one, displacement): (&TimedOdometry, &Pose)| {
            Some(PoseIncrement { time: one.time, displacement: *displacement })
        };
        return messages.iter().zip(&by_speeds).map(increment).collect();
    }
    if shown > 2.0 * spoken + LEAST && spoken > LEAST || spoken > 2.0 * shown + LEAST {
        account.warn(format!(
            "poses and speeds of the odometry contradict each other: {shown:.2} and {spoken:.2} (m and rad in all); the poses were believed"
        ));
    }
    let mut before: Option<Pose> = None;
    let mut found = Vec::with_capacity(messages.len());
    for (one, pose) in messages.iter().zip(poses) {
        let Some(pose) = pose else {
            let turn = &one.message.pose.pose.orientation;
            let why =
                if is_empty(turn) { "orientations of zeros only" } else { "poses that are no numbers or no rotations" };
            account
                .leave_out(format!("messages of the odometry with {why}"), format!("at {:.3} s", one.time.seconds()));
            found.push(None);
            continue;
        };
        account.take(1);
        let mut step = before.replace(pose).map_or(Pose::default(), |before| before.between(&pose));
        if one.is_restart && step.position().norm() > JUMP {
            account.warn(format!(
                "the odometry jumps by {:.2} m where its clock starts again: the vehicle was taken to have stood there",
                step.position().norm()
            ));
            step = Pose::default();
        }
        found.push(Some(PoseIncrement { time: one.time, displacement: step }));
    }
    found
}

fn pose(message: &Odometry) -> Option<Pose> {
    let told = &message.pose.pose;
    let pose = told.planar();
    (is_orientation(&told.orientation) && pose.is_finite()).then_some(pose)
}

fn steps(poses: &[Option<Pose>]) -> Vec<Option<Pose>> {
    poses.windows(2).map(|pair| Some(pair[0]?.between(&pair[1]?))).collect()
}

fn twist(message: &Odometry) -> Twist {
    let told = &message.twist.twist;
    let finite = |value: f64| if value.is_finite() { value } else { 0.0 };
    Twist { x: finite(told.linear.x), y: finite(told.linear.y), theta: finite(told.angular.z) }
}

/// The motion at the mean of the speeds at its ends.
fn step_of_speeds(messages: &[TimedOdometry], twists: &[Twist], index: usize) -> Pose {
    let Some(before) = index.checked_sub(1) else { return Pose::default() };
    let half = 0.5 * messages[index].time.since(messages[before].time).max(0.0);
    let (from, to) = (&twists[before], &twists[index]);
    Pose::exp(&Twist { x: half * (from.x + to.x), y: half * (from.y + to.y), theta: half * (from.theta + to.theta) })
}
