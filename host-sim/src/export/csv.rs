//! Poses as a table for spreadsheets: one row for each instant.

use std::io::Write;

use agv_core::integrity::Alarm;
use agv_core::localizer::{Mode, Reason};
use agv_core::state::ProtectionLevel;
use serde::Serialize;

use crate::drive::Track;
use crate::recording::{Recording, truth_at};

/// One instant. Lengths in m, times in s, angles in rad; empty where nobody knows.
#[derive(Serialize)]
struct Row {
    time_s: f64,
    way_m: f64,
    x_m: f64,
    y_m: f64,
    heading_rad: f64,
    deviation_x_m: f64,
    deviation_y_m: f64,
    deviation_heading_rad: f64,
    mode: Mode,
    reason: Reason,
    dead_reckoning_m: f64,
    acceptance: f64,
    normalised_square: f64,
    level_position_m: Option<f64>,
    level_heading_rad: Option<f64>,
    alarm: Alarm,
    correction_m: f64,
    true_x_m: Option<f64>,
    true_y_m: Option<f64>,
    true_heading_rad: Option<f64>,
}

/// A protection level; none where there is no bound.
fn bound(level: f64) -> Option<f64> {
    (level < 0.5 * ProtectionLevel::UNBOUNDED.position).then_some(level)
}

/// Writes the poses of a replayed drive, and beside them the true ones.
///
/// # Errors
/// If `output` takes no more.
pub fn write(recording: &Recording, track: &Track, output: impl Write) -> Result<(), csv::Error> {
    let mut table = csv::Writer::from_writer(output);
    for point in &track.points {
        let pose = point.output;
        let truth = truth_at(&recording.truth, pose.time);
        let [xx, _, yy, _, _, tt] = pose.covariance.map(|variance| variance.max(0.0).sqrt());
        table.serialize(Row {
            time_s: pose.time.seconds(),
            way_m: point.way,
            x_m: pose.pose.x,
            y_m: pose.pose.y,
            heading_rad: pose.pose.theta,
            deviation_x_m: xx,
            deviation_y_m: yy,
            deviation_heading_rad: tt,
            mode: pose.mode,
            reason: pose.reason,
            dead_reckoning_m: pose.dead_reckoning_distance,
            acceptance: pose.acceptance,
            normalised_square: pose.normalised_square,
            level_position_m: bound(pose.level.position),
            level_heading_rad: bound(pose.level.heading),
            alarm: recording.parameters.alert_limits.alarm(pose.mode, &pose.level),
            correction_m: pose.correction,
            true_x_m: truth.map(|truth| truth.x),
            true_y_m: truth.map(|truth| truth.y),
            true_heading_rad: truth.map(|truth| truth.theta),
        })?;
    }
    table.flush()?;
    Ok(())
}
