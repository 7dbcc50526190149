//! Localising in a kept map of contours that was made from the rest of the same drive.
//!
//! A window of 12 m is driven in a map of all scans, at corrected poses, that are at least 8 m of the way before it or behind
//! it. It counts if the map covers at least 70 per cent of its returns. All poses in it are compared with the corrected ones;
//! a window is lost if one of them is wrong by more than 0.5 m or 10 deg.

use std::collections::HashSet;

use agv_core::contours::{ContourMatch, Prediction, SurfacePoint, Surroundings, align, find_surface_points};
use agv_core::geometry::{Point, Pose, difference};
use agv_core::integrity::ProtectionLevel;
use agv_core::integrity::separation::fault_free;
use agv_core::localizer::PoseOutput;
use agv_core::sensing::PointScan;
use agv_core::state::{Mode, Reason};
use agv_host_sim::accuracy::Spread;
use agv_host_sim::import::{BEAMS, RANGES};
use agv_host_sim::mapping::contour_map::{ContourMap, ContourMapper};
use nalgebra::Matrix3;
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

/// One window that counts.
struct Run {
    poses: Vec<WindowPose>,
    by_contours: Vec<Compared>,
    by_odometry: Vec<Compared>,
}

/// Localises in all windows of `length` (m), with maps of cells of `cell` (m): by odometry and by contours, and the poses of the latter.
#[must_use]
pub fn localise(drive: &OfficeDrive, length: f64, cell: f64) -> (Vec<MapAccuracy>, Vec<WindowPose>) {
    let ways = ways(drive);
    let end_points: Vec<Vec<(i32, i32)>> = (0..drive.scans.len()).map(|scan| end_cells(drive, scan)).collect();
    let runs: Vec<Run> = windows(drive, length)
        .into_par_iter()
        .enumerate()
        .filter_map(|(number, window)| run(drive, (number, window), &ways, &end_points, cell))
        .collect();
    let by_odometry: Vec<_> = runs.iter().map(|run| run.by_odometry.as_slice()).collect();
    let by_contours: Vec<_> = runs.iter().map(|run| run.by_contours.as_slice()).collect();
    let accuracies = vec![accuracy("odometry", &by_odometry, false), accuracy("contours", &by_contours, true)];
    (accuracies, runs.into_iter().flat_map(|run| run.poses).collect())
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
    ways: &[f64],
    end_points: &[Vec<(i32, i32)>],
    cell: f64,
) -> Option<Run> {
    let (first, last) = window;
    let is_mapped =
        |scan: &usize| ways[*scan] <= ways[first] - MAP_DISTANCE || ways[*scan] >= ways[last] + MAP_DISTANCE;
    let mapped: Vec<usize> = (0..drive.scans.len()).filter(is_mapped).collect();
    if !is_covered(window, &mapped, end_points) {
        return None;
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
    let claims = localise_window(drive, window, &mapper.finish());
    let numbered = claims.iter().zip(first..);
    Some(Run {
        poses: numbered.clone().map(|(claim, scan)| WindowPose { window: number, scan, pose: claim.pose }).collect(),
        by_contours: numbered.map(|(claim, scan)| compared(scan, &claim.pose, Some(claim.level))).collect(),
        by_odometry,
    })
}

/// What the vehicle says of the pose of its laser at each scan: a chain of matches, each predicted by the odometry.
fn localise_window(drive: &OfficeDrive, (first, last): (usize, usize), map: &ContourMap) -> Vec<PoseOutput> {
    let Ok(map) = map.view() else { return Vec::new() };
    let mut surroundings: Box<Surroundings> = Box::default();
    let mut points: heapless::Vec<SurfacePoint, 400> = heapless::Vec::new();
    let mut scan_points: Box<PointScan<BEAMS>> = Box::default();
    let mut pose = drive.truth[first];
    let mut covariance = Matrix3::zeros();
    let mut claims = vec![claim(&pose, &covariance)];
    for scan in first + 1..=last {
        let step = drive.odometry[scan - 1].between(&drive.odometry[scan]);
        let predicted = Prediction::by_odometry(&pose, &step);
        scan_points.set(&drive.scans[scan].view(), RANGES.0, RANGES.1);
        find_surface_points(&scan_points, &mut points);
        let found = align(&points, surroundings.around(&map, &predicted.pose), &predicted);
        let jacobian = pose.compose_jacobian_first(&step);
        let position = predicted.position_deviation.powi(2);
        let by_step = nalgebra::Vector3::new(position, position, predicted.heading_deviation.powi(2));
        covariance = jacobian * covariance * jacobian.transpose() + Matrix3::from_diagonal(&by_step);
        covariance = corrected(covariance, found.as_ref());
        pose = found.map_or(predicted.pose, |found| found.pose);
        claims.push(claim(&pose, &covariance));
    }
    claims
}

/// By what the covariance of a match is multiplied that takes points as independent.
const INFLATION: f64 = 3.0;

/// The covariance behind a match: what it says nothing of stays as it was predicted. What was known before of the rest is not
/// counted: it came from the same map.
fn corrected(predicted: Matrix3<f64>, found: Option<&ContourMatch>) -> Matrix3<f64> {
    let Some(found) = found else { return predicted };
    let information = found.information / INFLATION;
    let Some(axis) = found.free_axis else { return information.try_inverse().unwrap_or(predicted) };
    // Along the free axis what was predicted holds.
    let (x, y) = (f64::from(axis.x), f64::from(axis.y));
    let along = nalgebra::Vector3::new(x, y, 0.0);
    let variance = (along.transpose() * predicted * along).x.max(1e-12);
    (information + along * along.transpose() / variance).try_inverse().unwrap_or(predicted)
}

/// A pose as the vehicle tells it.
fn claim(pose: &Pose, covariance: &Matrix3<f64>) -> PoseOutput {
    let [xx, xy, yy] = [covariance.m11, covariance.m12, covariance.m22];
    let entries = [xx, xy, yy, covariance.m13, covariance.m23, covariance.m33];
    PoseOutput {
        time: agv_core::measurement::Time::default(),
        pose: *pose,
        covariance: entries,
        mode: Mode::Features,
        reason: Reason::None,
        dead_reckoning_distance: 0.0,
        correction: 0.0,
        smooth: *pose,
        level: fault_free(&entries),
        acceptance: 1.0,
        normalised_square: 2.0,
        resets: 0,
        last_reset: 0.0,
        overflows: 0,
    }
}
