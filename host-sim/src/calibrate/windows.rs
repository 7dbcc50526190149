//! Windows of several lengths from a drive with a continuous source of poses.

use agv_core::geometry::Pose;
use agv_core::measurement::Time;
use nalgebra::{Matrix3, Vector3};

use super::counted::Counted;
use super::window::{Steps, Window};

/// Pose of S in any fixed frame, at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaserPose {
    /// When.
    pub time: Time,
    /// Where.
    pub pose: Pose,
}

/// Lengths of windows, s. Short ones are many; long ones tell small offsets, which unsteady clocks and counters that stall
/// and catch up would hide in short ones. The shortest is long enough not to be biased by those.
pub const WINDOW_SECONDS: [f64; 3] = [2.3, 9.2, 36.8];
/// Share of the way against the sense of travel that is still taken as play.
const LARGEST_BACKLASH: f64 = 0.02;
/// Stated deviations of a motion between two poses, m and rad; the fit estimates a factor to them.
const POSE_DEVIATIONS: [f64; 3] = [16e-3, 16e-3, 4e-3];

/// What was counted between two times: steps at one steering angle each, cut at both ends.
#[must_use]
pub fn steps_between(counted: &[Counted], start: Time, end: Time) -> Steps {
    let mut steps = Steps::default();
    let first = counted.partition_point(|sample| sample.time <= start).max(1);
    for pair in counted[first - 1..].windows(2) {
        let [before, after] = pair else { continue };
        if before.time >= end {
            break;
        }
        let duration = after.time.since(before.time);
        let inside = after.time.min(end).since(before.time.max(start));
        if inside > 0.0 {
            let share = inside / duration;
            steps.add((after.ticks - before.ticks) * share, 0.5 * (before.steering + after.steering));
        }
    }
    steps
}

/// Cuts a drive into windows of each of [`WINDOW_SECONDS`] between poses, side by side; those in which the vehicle reverses
/// or hardly moves (less than `shortest` ticks) are left out. Each part of the drive is in several windows, so deviations
/// of parameters are larger than independent windows would make them by the root of [`WINDOW_SECONDS`]'s length.
#[must_use]
pub fn windows(counted: &[Counted], poses: &[LaserPose], shortest: f64) -> Vec<Window> {
    let (Some(first), Some(last)) = (counted.first(), counted.last()) else {
        return Vec::new();
    };
    let is_usable = |pose: &&LaserPose| pose.pose.is_finite() && pose.time >= first.time && pose.time <= last.time;
    let usable: Vec<&LaserPose> = poses.iter().filter(is_usable).collect();
    let mut windows = Vec::new();
    for seconds in WINDOW_SECONDS {
        let mut begin = 0;
        while let Some(start) = usable.get(begin) {
            let end = usable.partition_point(|pose| pose.time.since(start.time) < seconds);
            let Some(stop) = usable.get(end) else { break };
            windows.extend(window(counted, start, stop, shortest));
            begin = end;
        }
    }
    windows
}

fn window(counted: &[Counted], start: &LaserPose, stop: &LaserPose, shortest: f64) -> Option<Window> {
    let steps = steps_between(counted, start.time, stop.time).finish();
    let way: f64 = steps.iter().map(|step| step.ticks).sum();
    let against: f64 = steps.iter().filter(|step| step.ticks * way < 0.0).map(|step| step.ticks.abs()).sum();
    let variances = Vector3::from(POSE_DEVIATIONS.map(|deviation| deviation * deviation));
    (way.abs() >= shortest && against <= LARGEST_BACKLASH * way.abs()).then(|| Window {
        start: start.time,
        end: stop.time,
        steps,
        motion: start.pose.between(&stop.pose),
        pose_errors: [Matrix3::zeros(), Matrix3::from_diagonal(&variances)],
        shares_start: false,
    })
}
