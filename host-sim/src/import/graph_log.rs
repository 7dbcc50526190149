//! Logs of a pose graph: `VERTEX2` (corrected robot pose), `ROBOTLASER1` (the scan taken there), `EDGE2` (relation).
//!
//! A `ROBOTLASER1` line follows its vertex and repeats robot and laser poses, corrected or not; only the laser's place
//! on the robot is taken from them. Edges are relations after correction, not odometry.

use std::path::Path;

use agv_core::geometry::Pose;

use super::scan_record::{Clock, count, pose, robot_laser};
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
}

/// Reads a graph log.
///
/// # Errors
/// If the file is missing, is not text, a line lacks a field or has one that is no number, or a scan has no vertex.
pub fn read(path: &Path) -> Result<GraphLog, TextFileError> {
    let text = text_file::read(path, "a pose graph with scans")?;
    let mut graph = GraphLog::default();
    let mut vertex = None;
    let mut clock = Clock::default();
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
                graph.log.scans.push(parse_scan(words, robot, &mut clock).ok_or_else(malformed)?);
            }
            _ => {}
        }
    }
    Ok(graph)
}

fn parse_vertex<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<Pose> {
    count(&mut words)?;
    pose(&mut words)
}

fn parse_edge<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<Edge> {
    Some(Edge { from: count(&mut words)?, to: count(&mut words)?, displacement: pose(&mut words)? })
}

/// A scan whose laser stands on the corrected robot as the log says.
fn parse_scan<'a>(mut words: impl Iterator<Item = &'a str>, robot: Pose, clock: &mut Clock) -> Option<PosedScan> {
    let (mut logged, seconds) = robot_laser(&mut words)?;
    logged.scan.start = clock.at(seconds);
    Some(PosedScan { laser: robot.compose(&logged.robot.between(&logged.laser)), robot, ..logged })
}
