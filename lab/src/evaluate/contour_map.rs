//! Localising in a kept map of contours that was made from the rest of the same drive.
//!
//! A window of 12 m is driven in a map of all scans, at corrected poses, that are at least 8 m of the way before it or behind
//! it. It counts if the map covers at least 70 per cent of its returns. All poses in it are compared with the corrected ones;
//! a window is lost if one of them is wrong by more than 0.5 m or 10 deg.

use std::collections::HashSet;

use agv_core::geometry::{Point, Pose, difference};
use agv_core::integrity::ProtectionLevel;
use agv_core::localizer::PoseOutput;
use agv_core::odometry::OdometryNoise;
use agv_host_sim::accuracy::Spread;
use agv_host_sim::contour_map::ContourMap;
use agv_host_sim::mapping::contour_mapper::ContourMapper;
use agv_host_sim::recording::RecordedEvent;
use agv_host_sim::replay::{ReplayError, replay_in};
use rayon::prelude::*;
use serde::Serialize;

use super::slam::OfficeDrive;
use super::windows::{WindowPose, ways, windows};

/// Along the way between a window and the scans of its map, m.
const MAP_DISTANCE: f64 = 8.0;

/// Least share of a window's returns that its map must cover, within this distance, m.
const COVERED: (f64, f64) = (0.7, 0.3);

/// Cells in which that is looked for, m.
const CELL: f64 = 0.05;

/// Returns between these ranges count for it, m.
const END_POINTS: (f32, f32) = (0.1, 30.0);

/// A pose that is further off is lost, m and rad.
const LOST: (f64, f64) = (0.5, 10.0 * std::f64::consts::PI / 180.0);

/// How good localising in the map is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MapAccuracy {
    /// How the vehicle localises.
    pub method: &'static str,
    /// Windows that count.
    pub windows: usize,
    /// Share of them in which the vehicle was lost.
    pub lost_share: f64,
    /// Share of the poses that are further off than their protection level; null for what states none.
    pub mi_share: Option<f64>,
    /// Distance from the corrected pose, m.
    pub position_m: Spread,
    /// Difference from its heading, deg.
    pub heading_deg: Spread,
}

/// A pose, and how far it is from the truth.
struct Compared {
    position: f64,
    heading: f64,
    is_misleading: bool,
}

/// The way up to each scan, m, and the cells of its returns.
struct Seen {
    ways: Vec<f64>,
    end_points: Vec<Vec<(i32, i32)>>,
}

/// One window that counts.
struct Run {
    poses: Vec<WindowPose>,
    outputs: Vec<(PoseOutput, Pose)>,
    by_contours: Vec<Compared>,
    by_odometry: Vec<Compared>,
}

/// What came out of all windows.
#[derive(Clone, Debug, PartialEq)]
pub struct Localised {
    /// By odometry and by contours.
    pub accuracies: Vec<MapAccuracy>,
    /// The poses by contours.
    pub poses: Vec<WindowPose>,
    /// What the vehicle said of each of them, beside the corrected pose.
    pub outputs: Vec<(PoseOutput, Pose)>,
}

/// Localises in all windows of `length` (m), with maps of cells of `cell` (m).
///
/// # Errors
/// If a window cannot be replayed.
pub fn localise(drive: &OfficeDrive, length: f64, cell: f64) -> Result<Localised, ReplayError> {
    let noise = drive.odometry_noise()?;
    let end_points = (0..drive.scans.len()).map(|scan| end_cells(drive, scan)).collect();
    let seen = Seen { ways: ways(drive), end_points };
    let runs: Vec<Run> = windows(drive, length)
        .into_par_iter()
        .enumerate()
        .filter_map(|(number, window)| run(drive, (number, window), &seen, cell, &noise).transpose())
        .collect::<Result<_, _>>()?;
    let by_odometry: Vec<_> = runs.iter().map(|run| run.by_odometry.as_slice()).collect();
    let by_contours: Vec<_> = runs.iter().map(|run| run.by_contours.as_slice()).collect();
    let accuracies = vec![accuracy("odometry", &by_odometry, false), accuracy("contours", &by_contours, true)];
    let outputs = runs.iter().flat_map(|run| run.outputs.iter().copied()).collect();
    Ok(Localised { accuracies, poses: runs.into_iter().flat_map(|run| run.poses).collect(), outputs })
}

fn accuracy(method: &'static str, runs: &[&[Compared]], has_level: bool) -> MapAccuracy {
    let is_lost = |run: &&&[Compared]| run.iter().any(|pose| pose.position > LOST.0 || pose.heading > LOST.1);
    let poses: Vec<&Compared> = runs.iter().copied().flatten().collect();
    let misleading = poses.iter().filter(|pose| pose.is_misleading).count() as f64 / poses.len().max(1) as f64;
    MapAccuracy {
        method,
        windows: runs.len(),
        lost_share: runs.iter().filter(is_lost).count() as f64 / runs.len().max(1) as f64,
        mi_share: has_level.then_some(misleading),
        position_m: Spread::of(poses.iter().map(|pose| pose.position)),
        heading_deg: Spread::of(poses.iter().map(|pose| pose.heading.to_degrees())),
    }
}

/// The cells of a scan's returns at its corrected pose.
fn end_cells(drive: &OfficeDrive, scan: usize) -> Vec<(i32, i32)> {
    let (pose, scan) = (&drive.truth[scan], &drive.scans[scan]);
    let counted = scan.ranges.iter().enumerate().filter(|(_, range)| **range >= END_POINTS.0 && **range < END_POINTS.1);
    let cell = |(beam, range): (usize, &f32)| {
        let (sine, cosine) = scan.view().bearing(beam).sin_cos();
        let point = pose.transform(&(Point::new(cosine, sine) * f64::from(*range))) / CELL;
        (point.x.floor() as i32, point.y.floor() as i32)
    };
    counted.map(cell).collect()
}

/// Whether the map of a window covers it.
fn is_covered((first, last): (usize, usize), map: &[usize], end_points: &[Vec<(i32, i32)>]) -> bool {
    let occupied: HashSet<(i32, i32)> = map.iter().flat_map(|scan| &end_points[*scan]).copied().collect();
    let reach = (COVERED.1 / CELL + 1e-9) as i32;
    let shifts: Vec<(i32, i32)> = (-reach..=reach)
        .flat_map(|x| (-reach..=reach).map(move |y| (x, y)))
        .filter(|(x, y)| x * x + y * y <= reach * reach)
        .collect();
    let points: Vec<_> = end_points[first..=last].iter().flatten().collect();
    let near =
        |point: &&&(i32, i32)| shifts.iter().any(|shift| occupied.contains(&(point.0 + shift.0, point.1 + shift.1)));
    points.iter().filter(near).count() as f64 >= COVERED.0 * points.len().max(1) as f64
}

fn run(
    drive: &OfficeDrive,
    (number, window): (usize, (usize, usize)),
    Seen { ways, end_points }: &Seen,
    cell: f64,
    noise: &OdometryNoise,
) -> Result<Option<Run>, ReplayError> {
    let (first, last) = window;
    let is_mapped =
        |scan: &usize| ways[*scan] <= ways[first] - MAP_DISTANCE || ways[*scan] >= ways[last] + MAP_DISTANCE;
    let mapped: Vec<usize> = (0..drive.scans.len()).filter(is_mapped).collect();
    if !is_covered(window, &mapped, end_points) {
        return Ok(None);
    }
    let mut mapper = ContourMapper::new(cell);
    for scan in mapped {
        mapper.add(&drive.scans[scan], &drive.truth[scan], None);
    }
    let compared = |scan: usize, pose: &Pose, level: Option<ProtectionLevel>| {
        let truth = &drive.truth[scan];
        let position = (pose.position() - truth.position()).norm();
        let heading = difference(pose.theta, truth.theta).abs();
        let is_misleading = level.is_some_and(|level| position > level.position || heading > level.heading);
        Compared { position, heading, is_misleading }
    };
    let mut pose = drive.truth[first];
    let by_odometry = (first..=last).map(|scan| {
        if scan > first {
            pose = pose.compose(&drive.odometry[scan - 1].between(&drive.odometry[scan]));
        }
        compared(scan, &pose, None)
    });
    let by_odometry = by_odometry.collect();
    let claims = localise_window(drive, window, &mapper.finish(), noise)?;
    let numbered = claims.iter().zip(first..);
    Ok(Some(Run {
        poses: numbered.clone().map(|(claim, scan)| WindowPose { window: number, scan, pose: claim.pose }).collect(),
        outputs: numbered.clone().map(|(claim, scan)| (*claim, drive.truth[scan])).collect(),
        by_contours: numbered.map(|(claim, scan)| compared(scan, &claim.pose, Some(claim.level))).collect(),
        by_odometry,
    }))
}

/// What the vehicle says of the pose of its laser at each scan.
fn localise_window(
    drive: &OfficeDrive,
    (first, last): (usize, usize),
    map: &ContourMap,
    noise: &OdometryNoise,
) -> Result<Vec<PoseOutput>, ReplayError> {
    let recording = drive.recording((first, last), drive.steps((first, last)), noise);
    let replay = replay_in(&recording, Some(map.view()), |_| {})?;
    let is_scan = |(event, _): &(&RecordedEvent, &PoseOutput)| matches!(event, RecordedEvent::Scan(_));
    Ok(recording.events.iter().zip(&replay.poses).filter(is_scan).map(|(_, pose)| *pose).collect())
}
