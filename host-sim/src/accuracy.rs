//! How far the localiser's poses are from the truth.

use agv_core::geometry::{Pose, difference};
use agv_core::localizer::PoseOutput;
use agv_core::measurement::Time;
use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

use crate::recording::Truth;
pub use crate::recording::truth_at;

/// Largest error of a position that can still be worked with, m (K 5.6).
pub const POSITION_REQUIREMENT: f64 = 0.02;

/// Largest error of a heading that can still be worked with, rad (K 5.6).
pub const HEADING_REQUIREMENT: f64 = 0.1 * std::f64::consts::PI / 180.0;

/// Error of one pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseError {
    /// When.
    pub time: Time,
    /// Distance of R from where it really was, m.
    pub position: f64,
    /// Heading minus the true heading, rad.
    pub heading: f64,
    /// Error squared, normalised by the stated covariance; chi-square with three degrees of freedom. None if the
    /// covariance is singular.
    pub normalised_square: Option<f64>,
}

impl PoseError {
    /// The error of a pose that was never given.
    pub const UNKNOWN: Self =
        Self { time: Time::from_micros(0), position: f64::INFINITY, heading: f64::INFINITY, normalised_square: None };
}

/// Median, 95th percentile and largest of a set.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Median.
    pub median: f64,
    /// 95th percentile.
    pub p95: f64,
    /// Largest.
    pub max: f64,
}

impl Spread {
    /// The spread of the values; all NaN if there are none.
    #[must_use]
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = values.into_iter().collect();
        sorted.sort_by(f64::total_cmp);
        Self { median: quantile(&sorted, 0.5), p95: quantile(&sorted, 0.95), max: quantile(&sorted, 1.0) }
    }
}

/// The quantile of sorted values, linear between neighbours; NaN if there are none.
#[must_use]
pub fn quantile(sorted: &[f64], share: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else {
        return f64::NAN;
    };
    let place = share * last as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(last);
    sorted[below] + (sorted[above] - sorted[below]) * (place - below as f64)
}

/// The pose that the localiser would publish at `time`: the last one, carried on by the odometry that follows. None
/// before the first pose and from the last one on.
#[must_use]
pub fn pose_at(poses: &[PoseOutput], time: Time) -> Option<Pose> {
    let after = poses.partition_point(|pose| pose.time <= time);
    let (last, next) = (poses.get(after.checked_sub(1)?)?, poses.get(after)?);
    let interval = next.time.since(last.time);
    let share = if interval > 0.0 { time.since(last.time) / interval } else { 0.0 };
    Some(last.pose.compose(&last.pose.between(&next.pose).fraction(share)))
}

/// Error of a pose against the true one of its time. None where the truth is not known.
#[must_use]
pub fn pose_error(output: &PoseOutput, truth: &[Truth]) -> Option<PoseError> {
    let true_pose = truth_at(truth, output.time)?;
    let error = Vector3::new(
        output.pose.x - true_pose.x,
        output.pose.y - true_pose.y,
        difference(output.pose.theta, true_pose.theta),
    );
    let [xx, xy, yy, xt, yt, tt] = output.covariance;
    let covariance = Matrix3::new(xx, xy, xt, xy, yy, yt, xt, yt, tt);
    let normalised_square = covariance.try_inverse().map(|information| (error.transpose() * information * error).x);
    Some(PoseError { time: output.time, position: error.x.hypot(error.y), heading: error.z, normalised_square })
}
