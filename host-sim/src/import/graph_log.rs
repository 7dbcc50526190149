//! Logs of a pose graph: `VERTEX2` (corrected robot pose), `ROBOTLASER1` (the scan taken there), `EDGE2` (relation).
//!
//! A `ROBOTLASER1` line follows its vertex and repeats robot and laser poses, corrected or not; only the laser's place
//! on the robot is taken from them. Edges are relations after correction, not odometry.

use std::path::Path;

use agv_core::geometry::Pose;
use agv_core::measurement::Time;

use super::{PosedScan, ScanLog};
use crate::recording::RecordedScan;
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
    let mut start = None;
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
                graph.log.scans.push(parse_scan(words, robot, &mut start).ok_or_else(malformed)?);
            }
            _ => {}
        }
    }
    Ok(graph)
}

fn number<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<f64> {
    words.next()?.parse().ok()
}

fn index<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<usize> {
    words.next()?.parse().ok()
}

fn pose<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<Pose> {
    Some(Pose::new(number(words)?, number(words)?, number(words)?))
}

fn parse_vertex<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<Pose> {
    index(&mut words)?;
    pose(&mut words)
}

fn parse_edge<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<Edge> {
    Some(Edge { from: index(&mut words)?, to: index(&mut words)?, displacement: pose(&mut words)? })
}

/// Fields: type, start angle, field of view, step, largest range, accuracy, remission mode, n, n ranges, m, m
/// remissions, laser pose, robot pose, five values of the base, time, host, time of logging. Angles rad, lengths m.
fn parse_scan<'a>(mut words: impl Iterator<Item = &'a str>, robot: Pose, start: &mut Option<f64>) -> Option<PosedScan> {
    let words = &mut words;
    number(words)?;
    let first_bearing = number(words)?;
    number(words)?;
    let bearing_step = number(words)?;
    for _ in 0..3 {
        number(words)?;
    }
    let ranges = (0..index(words)?).map(|_| number(words).map(|range| range as f32)).collect::<Option<Vec<_>>>()?;
    for _ in 0..index(words)? {
        number(words)?;
    }
    let (logged_laser, logged_robot) = (pose(words)?, pose(words)?);
    for _ in 0..5 {
        number(words)?;
    }
    let time = number(words)?;
    let start = *start.get_or_insert(time);
    let scan = RecordedScan {
        start: Time::from_seconds((time - start).max(0.0)),
        beam_interval: 0.0,
        first_bearing,
        bearing_step,
        ranges,
        intensities: Vec::new(),
    };
    Some(PosedScan { scan, laser: robot.compose(&logged_robot.between(&logged_laser)), robot })
}
