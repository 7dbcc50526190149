//! Whole drives through buildings that are not known, against the corrected poses of others: by the vehicle, which closes no loops, and by
//! the map that is made of the drive afterwards.

use agv_core::geometry::{Pose, difference};
use agv_core::localizer::MapUse;
use agv_host_sim::mapping::slam::SlamParameters;
use agv_host_sim::recording::RecordedEvent;
use agv_host_sim::replay::{ReplayError, replay};
use serde::Serialize;

use super::contours::follow;
use super::slam::{OfficeDrive, Outcome, SlamError, fitted, run};
use super::windows::ways;

/// Errors on the way are those of pieces of this length, m, that begin at every scan.
const PIECE: f64 = 20.0;

/// How a whole drive went.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DriveAccuracy {
    /// Name of the recording.
    pub set: String,
    /// How the poses were found.
    pub mode: &'static str,
    /// Length of the drive by the corrected poses, m.
    pub distance_m: f64,
    /// Mean error of the displacement over pieces of 20 m, in per cent of their length.
    pub error_percent: f64,
    /// Mean error of the turn over the same pieces, deg for a metre.
    pub error_deg_per_m: f64,
    /// Mean distance from the corrected poses after the best rigid fit, m.
    pub mean_error_m: f64,
    /// Largest such distance, m.
    pub max_error_m: f64,
    /// Loops that were closed.
    pub loops: usize,
    /// Loops that are wrong by more than 0.5 m or 10 degrees.
    pub false_loops: usize,
}

/// Why a drive was not measured.
#[derive(Debug, thiserror::Error)]
pub enum DriveError {
    /// It cannot be replayed.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// It cannot be mapped.
    #[error(transparent)]
    Slam(#[from] SlamError),
}

/// Follows a drive in every way.
///
/// # Errors
/// See [`DriveError`].
pub fn drive(set: &str, drive: &OfficeDrive, done: impl Fn()) -> Result<Vec<DriveAccuracy>, DriveError> {
    let all: Vec<usize> = (0..drive.scans.len()).collect();
    let whole = (0, drive.scans.len() - 1);
    let mut found = vec![accuracy(set, "odometry", drive, &all, &drive.odometry)];
    found.push(accuracy(set, "vehicle, slam", drive, &all, &by_vehicle(drive)?));
    done();
    let followed = follow(drive, whole, &drive.steps(whole)).poses;
    found.push(accuracy(set, "contours, no filter", drive, &all, &followed));
    done();
    let (Outcome { loops, false_loops, .. }, map) = run(drive, None, "all", &SlamParameters::all(), done)?;
    let keys: Vec<usize> = map.keys.iter().map(|key| key.scan).collect();
    found.push(DriveAccuracy { loops, false_loops, ..accuracy(set, "map --slam", drive, &keys, &map.poses) });
    Ok(found)
}

/// What the vehicle's own filter says at each scan, with the map in its state; the noise of the odometry is what the scans tell.
fn by_vehicle(drive: &OfficeDrive) -> Result<Vec<Pose>, ReplayError> {
    let whole = (0, drive.scans.len() - 1);
    let mut recording = drive.recording(whole, drive.steps(whole), &drive.odometry_noise()?);
    recording.parameters.maps = MapUse { reflectors: false, features: false, dynamic: false, slam: true };
    // Nothing tells where it is, so it grows uncertain.
    recording.parameters.limits.largest_position_deviation = 1e3;
    recording.parameters.limits.largest_heading_deviation = 1e3;
    recording.parameters.limits.lost_after = 1e6;
    let replay = replay(&recording, |_| {})?;
    let said = recording.events.iter().zip(&replay.poses);
    let at_scans = said.filter(|(event, _)| matches!(event, RecordedEvent::Scan(_)));
    Ok(at_scans.map(|(_, pose)| pose.pose).collect())
}

/// Accuracy of poses at some scans.
fn accuracy(set: &str, mode: &'static str, drive: &OfficeDrive, scans: &[usize], poses: &[Pose]) -> DriveAccuracy {
    let ways = ways(drive);
    let truth: Vec<Pose> = scans.iter().map(|scan| drive.truth[*scan]).collect();
    let shifts: Vec<f64> = fitted(poses, &truth).iter().map(|error| error.position().norm()).collect();
    let (mut shift, mut turn, mut pieces) = (0.0, 0.0, 0);
    for first in 0..scans.len() {
        let last = scans.partition_point(|scan| ways[*scan] < ways[scans[first]] + PIECE);
        if last == scans.len() {
            break;
        }
        let length = ways[scans[last]] - ways[scans[first]];
        let error = truth[first].between(&truth[last]).between(&poses[first].between(&poses[last]));
        shift += error.position().norm() / length;
        turn += difference(error.theta, 0.0).abs() / length;
        pieces += 1;
    }
    let share = 1.0 / f64::from(pieces.max(1));
    DriveAccuracy {
        set: set.to_owned(),
        mode,
        distance_m: ways.last().copied().unwrap_or_default(),
        error_percent: 100.0 * shift * share,
        error_deg_per_m: (turn * share).to_degrees(),
        mean_error_m: shifts.iter().sum::<f64>() / shifts.len().max(1) as f64,
        max_error_m: shifts.iter().copied().fold(0.0, f64::max),
        loops: 0,
        false_loops: 0,
    }
}
