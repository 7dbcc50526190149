//! By how much the laser's times are off those of the encoders: the shift of time with which both tell one motion.

use agv_core::odometry::Vehicle;

use super::counted::count;
use super::drive::{is_followed, located_poses};
use super::log_input::LogInput;
use super::model::VehicleModel;
use super::odometry_path::OdometryPath;
use super::tracking::track;
use super::windows::LaserPose;

/// How the laser's times are off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockOffset {
    /// By how much they are too late, s.
    pub late: f64,
    /// Standard deviation, s.
    pub deviation: f64,
}

impl ClockOffset {
    /// Whether it is more than chance, and more than a vehicle in motion can bear.
    #[must_use]
    pub fn is_clear(&self) -> bool {
        self.late.abs() > (CLEAR * self.deviation).max(HARMLESS)
    }
}

/// In standard deviations.
const CLEAR: f64 = 5.0;
/// At a metre a second this is a centimetre, s.
const HARMLESS: f64 = 0.01;
/// Time over which motions are compared, s.
const SPAN: f64 = 0.4;
/// Farthest shift that is looked for, and between what is tried first, s.
const FARTHEST: f64 = 1.0;
const STRIDE: f64 = 0.02;
/// A motion that differs by more is off for another reason, m; a radian counts as a metre.
const MOST: f64 = 0.1;
/// Motions that are compared at least.
const FEWEST: usize = 50;
/// Share of the motion that may be left over.
const LEFT: f64 = 0.3;
/// What is left of neighbouring motions is not independent: they share a pose.
const CORRELATED: f64 = 1.5;

/// Looks for the shift. None if the log is not of a tricycle among reflectors, if its encoders do not tell the laser's motion under
/// any shift, or if the vehicle never changes its speed.
#[must_use]
pub fn clock_offset(input: &LogInput) -> Option<ClockOffset> {
    let Vehicle::Tricycle(tricycle) = input.parameters.vehicle else { return None };
    let (counted, _) = count(&input.encoders, &tricycle, false);
    let path = OdometryPath::new(&counted, &VehicleModel::nominal(&tricycle, input.parameters.lasers.first()));
    let tracked = track(&input.revolutions, &path);
    let poses = located_poses(&tracked);
    if !is_followed(&tracked) {
        return None;
    }
    let pairs = pairs(&poses);
    if pairs.len() < FEWEST {
        return None;
    }
    let cost = |late: f64| mean(&pairs, |first, second| difference(&path, first, second, late).min(MOST).powi(2));
    let steps = (FARTHEST / STRIDE).round() as i32;
    let coarse = (-steps..=steps).map(|step| f64::from(step) * STRIDE).min_by(|a, b| cost(*a).total_cmp(&cost(*b)))?;
    // The cost is a parabola near its least.
    let [before, at, after] = [coarse - STRIDE, coarse, coarse + STRIDE].map(cost);
    let curvature = (before + after - 2.0 * at) / (2.0 * STRIDE * STRIDE);
    let motion = mean(&pairs, |first, second| {
        let moved = first.pose.between(&second.pose);
        (moved.position().norm() + moved.theta.abs()).powi(2)
    });
    if coarse.abs() >= FARTHEST - 0.5 * STRIDE || curvature <= 0.0 || at > LEFT * LEFT * motion {
        return None;
    }
    let late = coarse + (before - after) / (4.0 * STRIDE * curvature);
    Some(ClockOffset { late, deviation: CORRELATED * (at / (pairs.len() as f64 * curvature)).sqrt() })
}

/// Poses with those that follow after the span.
fn pairs(poses: &[LaserPose]) -> Vec<[LaserPose; 2]> {
    let mut pairs: Vec<[LaserPose; 2]> = Vec::new();
    let mut last: Option<LaserPose> = None;
    for pose in poses {
        match last {
            Some(before) if pose.time.since(before.time) < SPAN => {}
            // A gap tells little of when something happened.
            Some(before) if pose.time.since(before.time) > 2.0 * SPAN => last = Some(*pose),
            Some(before) => {
                pairs.push([before, *pose]);
                last = Some(*pose);
            }
            None => last = Some(*pose),
        }
    }
    pairs
}

fn mean(pairs: &[[LaserPose; 2]], value: impl Fn(&LaserPose, &LaserPose) -> f64) -> f64 {
    pairs.iter().map(|[first, second]| value(first, second)).sum::<f64>() / pairs.len() as f64
}

/// What the laser and the encoders say differently of a motion, m, if the laser's times are so late.
fn difference(path: &OdometryPath, first: &LaserPose, second: &LaserPose, late: f64) -> f64 {
    let measured = first.pose.between(&second.pose);
    let claimed = path.laser_at(first.time.offset(-late)).between(&path.laser_at(second.time.offset(-late)));
    let turned = agv_core::geometry::difference(measured.theta, claimed.theta);
    (measured.position() - claimed.position()).norm().hypot(turned)
}
