//! Mapping a real office from raw odometry and scans, against the corrected poses of others.

use std::collections::BTreeMap;
use std::path::Path;

use agv_core::geometry::{Point, Pose, difference};
use agv_core::measurement::Time;
use agv_core::places::align;
use serde::Serialize;

use crate::import::{ScanLog, carmen};
use crate::mapping::pose_graph::{Edge, PoseGraphError};
use crate::mapping::slam::{SlamMap, SlamParameters, map};
use crate::text_file::TextFileError;

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

/// Where raw odometry has the laser at each scan; the first scan is where its corrected pose is.
#[must_use]
pub fn odometry(log: &ScanLog) -> Vec<Pose> {
    let mut at = Vec::with_capacity(log.increments.len() + 1);
    let mut pose = Pose::default();
    at.push((Time::default(), pose));
    for increment in &log.increments {
        pose = pose.compose(&increment.displacement);
        at.push((increment.time, pose));
    }
    let robot = |time: Time| {
        let after = at.partition_point(|(other, _)| *other <= time);
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
    let laser_of = |scan: &crate::import::PosedScan| scan.robot.between(&scan.laser);
    log.scans.iter().map(|scan| robot(scan.scan.start).compose(&laser_of(scan))).collect()
}

/// Maps a CARMEN log with corrected poses, which the mapping does not see.
///
/// # Errors
/// See [`SlamError`].
pub fn run(
    log: &Path,
    relations: Option<(&Path, &Path)>,
    closures: &'static str,
    parameters: &SlamParameters,
    done: impl Fn(),
) -> Result<(Outcome, SlamMap, Vec<Pose>), SlamError> {
    let log = carmen::read(log)?.front;
    let poses = odometry(&log);
    let scans: Vec<_> = log.scans.iter().zip(&poses).map(|(scan, pose)| (&scan.scan, *pose)).collect();
    let map = map(&scans, parameters, done)?;
    let truth: Vec<Pose> = map.keys.iter().map(|key| log.scans[key.scan].laser).collect();
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
        Some((file, graph)) => relation_errors(file, graph, &map, &truth)?,
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
    Ok((outcome, map, truth))
}

/// Errors of poses after the best rigid fit of their positions to the true ones.
fn fitted(poses: &[Pose], truth: &[Pose]) -> Vec<Pose> {
    let pairs = poses.iter().zip(truth).map(|(pose, truth)| (pose.position(), truth.position(), 1.0));
    let fit = align(pairs).map_or_else(Pose::default, |fit| fit.pose);
    poses.iter().zip(truth).map(|(pose, truth)| truth.between(&fit.compose(pose))).collect()
}

/// Errors of hand-verified relations between scans that are named by their time in the graph log.
fn relation_errors(file: &Path, graph: &Path, map: &SlamMap, truth: &[Pose]) -> Result<Option<Relations>, SlamError> {
    let text = crate::text_file::read(file, "relations of a log")?;
    let times = logging_times(&crate::text_file::read(graph, "a pose graph with scans")?);
    // A scan of the graph log is in the map if a key scan was taken so near to it that nothing moves in between.
    let key_of = |name: &str| {
        let name: f64 = name.parse().ok()?;
        let time = times.range(nano(name - 1e-4)..=nano(name + 1e-4)).next()?.1;
        let number = map.keys.partition_point(|key| key.time.seconds() < time - NEAR);
        map.keys.get(number).filter(|key| (key.time.seconds() - time).abs() <= NEAR).map(|_| number)
    };
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
const NEAR: f64 = 0.02;

fn nano(seconds: f64) -> i64 {
    (seconds * 1e9) as i64
}

/// For each scan of a graph log, by its own time, the time of logging, counted from the first one, s.
fn logging_times(text: &str) -> BTreeMap<i64, f64> {
    let mut times = BTreeMap::new();
    let mut start = None;
    for line in text.lines().filter(|line| line.starts_with("ROBOTLASER1")) {
        let mut words = line.split_ascii_whitespace().rev();
        let (Some(logged), Some(_), Some(own)) = (words.next(), words.next(), words.next()) else { continue };
        if let (Ok(logged), Ok(own)) = (logged.parse::<f64>(), own.parse::<f64>()) {
            let start = *start.get_or_insert(logged);
            times.insert(nano(own), logged - start);
        }
    }
    times
}

/// Where the points of a map lie once it is fitted to the true poses, m.
#[must_use]
pub fn fitted_points(map: &SlamMap, truth: &[Pose]) -> Vec<Point> {
    let pairs = map.poses.iter().zip(truth).map(|(pose, truth)| (pose.position(), truth.position(), 1.0));
    let fit = align(pairs).map_or_else(Pose::default, |fit| fit.pose);
    map.points().iter().map(|point| fit.transform(point)).collect()
}
