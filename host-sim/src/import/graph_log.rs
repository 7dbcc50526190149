//! Logs of a pose graph: `VERTEX2` (corrected robot pose), `ROBOTLASER1` (the scan taken there), `EDGE2` (relation).
//!
//! A `ROBOTLASER1` line follows its vertex and repeats robot and laser poses, corrected or not; only the laser's place
//! on the robot is taken from them. Edges are relations after correction, not odometry.

use std::path::Path;

use agv_core::geometry::Pose;

use super::line_times::{NOT_FINITE, Record, TimeDefects, TimedLine, times};
use super::scan_record::{count, pose, robot_laser};
use super::{PosedScan, ScanLog};
use crate::account::Account;
use crate::text_file::{self, TextFileError};

/// A relation between two vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Index of the vertex in whose frame the displacement is given.
    pub from: usize,
    /// Index of the other vertex.
    pub to: usize,
    /// Pose of `to` in `from`.
    pub displacement: Pose,
}

/// A pose graph with its scans.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GraphLog {
    /// Scans with corrected poses; no increments.
    pub log: ScanLog,
    /// Relations in order of the file.
    pub edges: Vec<Edge>,
    /// What was wrong with the times; none of those written are used if there is anything.
    pub defects: TimeDefects,
    /// What was left out and is doubtful, without the times.
    pub account: Account,
}

/// Reads a graph log.
///
/// # Errors
/// If the file is missing, is not text, a line lacks a field or has one that is no number, or a scan has no vertex. A log that ends in the
/// middle of a line is read up to there.
pub fn read(path: &Path) -> Result<GraphLog, TextFileError> {
    let text = text_file::read_unpacked_as_far(path, "a pose graph with scans")?;
    let mut graph = GraphLog::default();
    if text.is_cut {
        graph.account.warn("the compressed file ends early: it was read up to there");
    }
    let mut vertex = None;
    let mut lines = Vec::new();
    let count = text.text.lines().count();
    // A last line that does not end may have been cut anywhere.
    let ends_early = !text.text.ends_with('\n');
    for (line, text) in (1..).zip(text.text.lines()) {
        let mut words = text.split_ascii_whitespace();
        let record = words.next().unwrap_or_default();
        let malformed = || TextFileError::of_line(path, line, super::missing_field(record));
        let no_vertex = || TextFileError::of_line(path, line, "a scan comes before the first vertex");
        if ends_early && line == count && is_cut(record, words.clone()) {
            graph.account.warn(format!("the file ends in the middle of line {line}: it was read up to there"));
            break;
        }
        match record {
            "VERTEX2" => vertex = Some(parse_vertex(words).ok_or_else(malformed)?),
            "EDGE2" => graph.edges.push(parse_edge(words).ok_or_else(malformed)?),
            "ROBOTLASER1" => {
                let robot = vertex.ok_or_else(no_vertex)?;
                let (scan, seconds) = parse_scan(words, robot, &mut graph.account).ok_or_else(malformed)?;
                let timed = TimedLine::new(seconds, Record::Front(scan));
                lines.push(timed.ok_or_else(|| TextFileError::of_line(path, line, NOT_FINITE))?);
            }
            _ => {}
        }
    }
    let (times, defects) = times(&lines);
    let timed = lines.into_iter().zip(times).filter_map(|(line, time)| match line.record {
        Record::Front(mut posed) => {
            posed.scan.start = time;
            Some(posed)
        }
        Record::Rear(_) | Record::Odometry(_) | Record::Anchor(_) => None,
    });
    graph.log.scans = timed.collect();
    graph.defects = defects;
    Ok(graph)
}

/// Whether a last line without an end lacks fields.
fn is_cut<'a>(record: &str, mut words: impl Iterator<Item = &'a str>) -> bool {
    match record {
        "VERTEX2" => true,
        // The information of a relation has six numbers.
        "EDGE2" => words.count() < 11,
        "ROBOTLASER1" => {
            robot_laser(&mut words, &mut Account::default()).is_none()
                || words.next().is_none()
                || words.next().is_none()
        }
        _ => false,
    }
}

fn parse_vertex<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<Pose> {
    count(&mut words)?;
    pose(&mut words)
}

fn parse_edge<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<Edge> {
    Some(Edge { from: count(&mut words)?, to: count(&mut words)?, displacement: pose(&mut words)? })
}

/// A scan whose laser stands on the corrected robot as the log says, without its time, and that time, s.
fn parse_scan<'a>(
    mut words: impl Iterator<Item = &'a str>,
    robot: Pose,
    account: &mut Account,
) -> Option<(PosedScan, f64)> {
    let (logged, seconds) = robot_laser(&mut words, account)?;
    Some((PosedScan { laser: robot.compose(&logged.robot.between(&logged.laser)), robot, ..logged }, seconds))
}
