//! Logs of a pose graph: `VERTEX2` (corrected robot pose), `ROBOTLASER1` (the scan taken there), `EDGE2` (relation).
//!
//! A `ROBOTLASER1` line follows its vertex and repeats robot and laser poses, corrected or not; only the laser's place
//! on the robot is taken from them. Edges are relations after correction, not odometry.

use std::path::Path;

use agv_core::geometry::Pose;

use super::line_times::{NOT_FINITE, Record, TimeDefects, TimedLine, times};
use super::scan_record::{count, pose, robot_laser};
use super::{PosedScan, ScanLog};
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
}

/// Reads a graph log.
///
/// # Errors
/// If the file is missing, is not text, a line lacks a field or has one that is no number, or a scan has no vertex.
pub fn read(path: &Path) -> Result<GraphLog, TextFileError> {
    let text = text_file::read(path, "a pose graph with scans")?;
    let mut graph = GraphLog::default();
    let mut vertex = None;
    let mut lines = Vec::new();
    for (line, text) in (1..).zip(text.lines()) {
        let mut words = text.split_ascii_whitespace();
        let record = words.next().unwrap_or_default();
        let malformed = || TextFileError::of_line(path, line, super::missing_field(record));
        let no_vertex = || TextFileError::of_line(path, line, "a scan comes before the first vertex");
        match record {
            "VERTEX2" => vertex = Some(parse_vertex(words).ok_or_else(malformed)?),
            "EDGE2" => graph.edges.push(parse_edge(words).ok_or_else(malformed)?),
            "ROBOTLASER1" => {
                let robot = vertex.ok_or_else(no_vertex)?;
                let (scan, seconds) = parse_scan(words, robot).ok_or_else(malformed)?;
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

fn parse_vertex<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<Pose> {
    count(&mut words)?;
    pose(&mut words)
}

fn parse_edge<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<Edge> {
    Some(Edge { from: count(&mut words)?, to: count(&mut words)?, displacement: pose(&mut words)? })
}

/// A scan whose laser stands on the corrected robot as the log says, without its time, and that time, s.
fn parse_scan<'a>(mut words: impl Iterator<Item = &'a str>, robot: Pose) -> Option<(PosedScan, f64)> {
    let (logged, seconds) = robot_laser(&mut words)?;
    Some((PosedScan { laser: robot.compose(&logged.robot.between(&logged.laser)), robot, ..logged }, seconds))
}
