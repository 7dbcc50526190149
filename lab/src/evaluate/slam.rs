//! Mapping a real office from raw odometry and scans, against the corrected poses of others.

use std::collections::BTreeMap;
use std::path::Path;

use agv_core::geometry::fit_rigid;
use agv_core::geometry::{Point, Pose, difference};
use agv_core::measurement::Time;
use serde::Serialize;

use agv_host_sim::import::carmen::TimeDefects;
use agv_host_sim::import::{ScanLog, carmen, graph_log};
use agv_host_sim::mapping::pose_graph::{Edge, PoseGraphError};
use agv_host_sim::mapping::slam::{SlamMap, SlamParameters, map};
use agv_host_sim::recording::RecordedScan;
use agv_host_sim::report::{FigureError, Map, Page, PointSet, Series, Table, trajectory_plot};
use agv_host_sim::text_file::{self, TextFileError};

/// How good a map is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Which loops were allowed.
    pub closures: &'static str,
    /// Number of key scans.
    pub key_scans: usize,
    /// Mean distance of the poses from the corrected ones, after the best rigid fit of all, m.
    pub mean_position_error_m: f64,
    /// Largest such distance, m.
    pub max_position_error_m: f64,
    /// Mean difference of the heading, deg.
    pub mean_heading_error_deg: f64,
    /// The mean distance of raw odometry, m.
    pub odometry_error_m: f64,
    /// Loops in the map.
    pub loops: usize,
    /// Loops that were found and taken out again.
    pub refused: usize,
    /// Loops in the map that are wrong by more than 0.5 m or 10 degrees.
    pub false_loops: usize,
    /// Error of the hand-verified relations: root mean square of the shift, m, and of the turn, deg, and how many of them
    /// have both ends among the key scans.
    pub relations: Option<Relations>,
    /// Processor time, s.
    pub seconds: f64,
}

/// Errors against hand-verified relations (the usual metric of the SLAM benchmark).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Relations {
    /// Relations with both ends in the map.
    pub relations: usize,
    /// Mean of the absolute error of the shift, m.
    pub mean_shift_m: f64,
    /// Mean of the absolute error of the turn, deg.
    pub mean_turn_deg: f64,
    /// The same of the corrected poses themselves: the accuracy of the comparison.
    pub corrected_mean_shift_m: f64,
}

/// Why the experiment cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum SlamError {
    /// The log cannot be read.
    #[error(transparent)]
    Import(#[from] TextFileError),
    /// The map cannot be made.
    #[error(transparent)]
    PoseGraph(#[from] PoseGraphError),
}

/// Scans with raw odometry, and the corrected poses that the mapping does not see.
#[derive(Clone, Debug)]
pub struct OfficeDrive {
    /// Scans.
    pub scans: Vec<RecordedScan>,
    /// Pose of the laser at each scan by raw odometry.
    pub odometry: Vec<Pose>,
    /// Corrected pose of the laser at each scan.
    pub truth: Vec<Pose>,
    /// What was wrong with the times of the log.
    pub defects: TimeDefects,
    /// Number of the scan by its own time in the log, ns; empty if the log has no relations.
    by_time: BTreeMap<i64, usize>,
}

impl OfficeDrive {
    /// A CARMEN log with both.
    ///
    /// # Errors
    /// If the log cannot be read.
    pub fn of_carmen(log: &Path) -> Result<Self, TextFileError> {
        let path = log;
        let carmen::CarmenLog { front: log, defects, .. } = carmen::read(path)?;
        if log.increments.is_empty() {
            return Err(TextFileError::of_line(path, 1, "this log has scans but no raw odometry (ODOM)"));
        }
        let times: Vec<Time> = log.scans.iter().map(|scan| scan.scan.start).collect();
        let odometry = odometry_at(&log, &times);
        let odometry =
            odometry.iter().zip(&log.scans).map(|(robot, scan)| robot.compose(&scan.robot.between(&scan.laser)));
        Ok(Self {
            odometry: odometry.collect(),
            truth: log.scans.iter().map(|scan| scan.laser).collect(),
            scans: log.scans.into_iter().map(|scan| scan.scan).collect(),
            defects,
            by_time: BTreeMap::new(),
        })
    }

    /// The scans and corrected poses of a graph log, with the raw odometry of the CARMEN log of the same drive: each
    /// scan of the graph log states when it was logged, by the clock of the other.
    ///
    /// # Errors
    /// If a log cannot be read.
    pub fn of_graph(graph: &Path, carmen_log: &Path) -> Result<Self, TextFileError> {
        let scans = graph_log::read(graph)?.log.scans;
        let logged = logging_times(&text_file::read(graph, "a pose graph with scans")?);
        let times: Vec<Time> = logged.iter().map(|(_, logged)| Time::from_seconds(*logged)).collect();
        let odometry = odometry_at(&carmen::read(carmen_log)?.front, &times);
        let odometry = odometry.iter().zip(&scans).map(|(robot, scan)| robot.compose(&scan.robot.between(&scan.laser)));
        Ok(Self {
            odometry: odometry.collect(),
            truth: scans.iter().map(|scan| scan.laser).collect(),
            scans: scans.into_iter().map(|scan| scan.scan).collect(),
            defects: TimeDefects::default(),
            by_time: logged.iter().enumerate().map(|(number, (own, _))| (nano(*own), number)).collect(),
        })
    }
}

/// Where raw odometry has the robot at those times.
fn odometry_at(log: &ScanLog, times: &[Time]) -> Vec<Pose> {
    let mut at = Vec::with_capacity(log.increments.len() + 1);
    let mut pose = Pose::default();
    at.push((Time::default(), pose));
    for increment in &log.increments {
        pose = pose.compose(&increment.displacement);
        at.push((increment.time, pose));
    }
    let robot = |time: &Time| {
        let after = at.partition_point(|(other, _)| other <= time);
        match (at.get(after.wrapping_sub(1)), at.get(after)) {
            (Some(before), Some(next)) => {
                let duration = next.0.since(before.0);
                let share = if duration > 0.0 { time.since(before.0) / duration } else { 0.0 };
                before.1.compose(&before.1.between(&next.1).fraction(share))
            }
            (Some(last), None) => last.1,
            (None, _) => Pose::default(),
        }
    };
    times.iter().map(robot).collect()
}

/// Maps a drive.
///
/// # Errors
/// See [`SlamError`].
pub fn run(
    drive: &OfficeDrive,
    relations: Option<&Path>,
    closures: &'static str,
    parameters: &SlamParameters,
    done: impl Fn(),
) -> Result<(Outcome, SlamMap), SlamError> {
    let scans: Vec<_> = drive.scans.iter().zip(drive.odometry.iter().copied()).collect();
    let map = map(&scans, parameters, done)?;
    let truth: Vec<Pose> = map.keys.iter().map(|key| drive.truth[key.scan]).collect();
    let errors = fitted(&map.poses, &truth);
    let drift: Vec<Pose> = map.keys.iter().map(|key| key.odometry).collect();
    let shifts = |errors: &[Pose]| errors.iter().map(|error| error.position().norm()).collect::<Vec<_>>();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let is_false = |edge: &&Edge| {
        let error = edge.error(&truth);
        error.position().norm() > 0.5 || error.theta.abs() > 10_f64.to_radians()
    };
    let shift = shifts(&errors);
    let relations = match relations {
        Some(file) => relation_errors(file, drive, &map)?,
        None => None,
    };
    let outcome = Outcome {
        closures,
        key_scans: map.keys.len(),
        mean_position_error_m: mean(&shift),
        max_position_error_m: shift.iter().copied().fold(0.0, f64::max),
        mean_heading_error_deg: mean(&errors.iter().map(|error| error.theta.abs()).collect::<Vec<_>>()).to_degrees(),
        odometry_error_m: mean(&shifts(&fitted(&drift, &truth))),
        loops: map.closures.len(),
        refused: map.refused.len(),
        false_loops: map.closures.iter().filter(is_false).count(),
        relations,
        seconds: map.elapsed,
    };
    Ok((outcome, map))
}

/// Errors of poses after the best rigid fit of their positions to the true ones.
pub(super) fn fitted(poses: &[Pose], truth: &[Pose]) -> Vec<Pose> {
    let fit = fit(poses, truth);
    poses.iter().zip(truth).map(|(pose, truth)| truth.between(&fit.compose(pose))).collect()
}

/// Errors of hand-verified relations between scans that are named by their time in the graph log.
fn relation_errors(file: &Path, drive: &OfficeDrive, map: &SlamMap) -> Result<Option<Relations>, TextFileError> {
    let text = text_file::read(file, "relations of a log")?;
    // The two files round the time differently.
    let key_of = |name: &str| {
        let name: f64 = name.parse().ok()?;
        let (_, scan) = drive.by_time.range(nano(name - SAME_TIME)..=nano(name + SAME_TIME)).next()?;
        map.keys.binary_search_by_key(scan, |key| key.scan).ok()
    };
    let truth: Vec<Pose> = map.keys.iter().map(|key| drive.truth[key.scan]).collect();
    let (mut shift, mut turn, mut corrected, mut count) = (0.0, 0.0, 0.0, 0);
    for line in text.lines() {
        let words: Vec<_> = line.split_ascii_whitespace().collect();
        let [from, to, x, y, _, _, _, yaw] = words[..] else { continue };
        let (Some(from), Some(to)) = (key_of(from), key_of(to)) else { continue };
        let numbers: Result<Vec<f64>, _> = [x, y, yaw].iter().map(|word| word.parse()).collect();
        let Ok(numbers) = numbers else { continue };
        let relation = Pose::new(numbers[0], numbers[1], numbers[2]);
        let error = relation.between(&map.poses[from].between(&map.poses[to]));
        shift += error.position().norm();
        turn += difference(error.theta, 0.0).abs();
        corrected += relation.between(&truth[from].between(&truth[to])).position().norm();
        count += 1;
    }
    let share = 1.0 / f64::from(count.max(1));
    Ok((count > 0).then_some(Relations {
        relations: count as usize,
        mean_shift_m: shift * share,
        mean_turn_deg: (turn * share).to_degrees(),
        corrected_mean_shift_m: corrected * share,
    }))
}

/// Scans this near in time are one, s.
const SAME_TIME: f64 = 1e-4;

fn nano(seconds: f64) -> i64 {
    (seconds * 1e9) as i64
}

/// Of each scan of a graph log its own time and that of logging, counted from the first one, s.
fn logging_times(text: &str) -> Vec<(f64, f64)> {
    let mut start = None;
    let of_line = |line: &str| {
        let mut words = line.split_ascii_whitespace().rev();
        let (logged, _, own) = (words.next()?, words.next()?, words.next()?);
        let logged: f64 = logged.parse().ok()?;
        let start = *start.get_or_insert(logged);
        Some((own.parse().ok()?, logged - start))
    };
    text.lines().filter(|line| line.starts_with("ROBOTLASER1")).filter_map(of_line).collect()
}

/// A page with the figures, and each map drawn over the corrected poses that it was fitted to.
///
/// # Errors
/// If a picture cannot be drawn.
pub fn page(drive: &OfficeDrive, results: &[(Outcome, SlamMap)]) -> Result<Page, FigureError> {
    let mut page = Page::new("Mapping from raw odometry and scans");
    page.section("Figures").paragraph(
        "Distance of the key scans from the corrected poses after the best rigid fit. 'honest' loops join scans that are \
         well apart in time, 'all' any that are no neighbours. Relations are displacements verified by hand.",
    );
    let heading =
        ["loops", "mean, m", "largest, m", "heading, deg", "odometry, m", "found", "taken out", "false left in"];
    let mut heading: Vec<_> = heading.map(str::to_owned).to_vec();
    heading.extend(["relations", "mean error, m", "of the corrected poses, m"].map(str::to_owned));
    let rows = results.iter().map(|(outcome, _)| {
        let mut row = vec![
            outcome.closures.to_owned(),
            format!("{:.3}", outcome.mean_position_error_m),
            format!("{:.3}", outcome.max_position_error_m),
            format!("{:.2}", outcome.mean_heading_error_deg),
            format!("{:.2}", outcome.odometry_error_m),
            outcome.loops.to_string(),
            outcome.refused.to_string(),
            outcome.false_loops.to_string(),
        ];
        row.extend(outcome.relations.iter().flat_map(|relations| {
            [
                relations.relations.to_string(),
                format!("{:.3}", relations.mean_shift_m),
                format!("{:.3}", relations.corrected_mean_shift_m),
            ]
        }));
        row
    });
    page.table(&Table { rows: rows.collect(), heading });
    for (outcome, map) in results {
        let truth: Vec<Pose> = map.keys.iter().map(|key| drive.truth[key.scan]).collect();
        let fit = fit(&map.poses, &truth);
        let pair = |point: Point| (point.x, point.y);
        let points: Vec<_> = map.points().iter().map(|point| pair(fit.transform(point))).collect();
        let mapped: Vec<_> = map.poses.iter().map(|pose| pair(fit.compose(pose).position())).collect();
        let corrected: Vec<_> = truth.iter().map(|pose| pair(pose.position())).collect();
        let figure = trajectory_plot(
            &Map { outlines: &[], landmarks: &[PointSet { name: "returns", points: &points }] },
            &[Series { name: "corrected", points: &corrected }, Series { name: "mapped", points: &mapped }],
        )?;
        page.section(&format!("Loops: {}", outcome.closures));
        page.figure(&figure, "Returns of the key scans, and where the laser was.");
    }
    Ok(page)
}

fn fit(poses: &[Pose], truth: &[Pose]) -> Pose {
    let pairs = poses.iter().zip(truth).map(|(pose, truth)| (pose.position(), truth.position(), 1.0));
    fit_rigid(pairs).map_or_else(Pose::default, |fit| fit.pose)
}
