//! CARMEN logs: lines of `FLASER`, `RLASER` and `ODOM` (old format) and `ROBOTLASER1`, `ROBOTLASER2` (new format), plain
//! or compressed with gzip.
//!
//! The poses of a scan are corrected ones if the log has been corrected. The logs of the SLAM benchmark repeat the
//! corrected pose after each scan as an `ODOM` line, most of them with time zero: from there the next `ODOM` lines go on by
//! raw odometry. Such a line moves the anchor and is no motion.
//!
//! Times are seconds, but some logs hold rounded ones, none, or a mixture of two clocks. If the times of a log contradict
//! the order of its lines, all of them are made from that order, and `CarmenLog::defects` says so.

use std::path::Path;

use agv_core::geometry::Pose;
use agv_core::measurement::PoseIncrement;

pub use super::line_times::TimeDefects;
use super::line_times::{NOT_FINITE, Record, TimedLine, times};
use super::scan_record::{number, pose, ranges, robot_laser, scan};
use super::{PosedScan, ScanLog};
use crate::text_file::{self, TextFileError};

/// A CARMEN log by laser.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CarmenLog {
    /// Scans of the front laser, and the odometry. Bearings are those of the laser that looks ahead.
    pub front: ScanLog,
    /// Scans of the rear laser, in the rear laser's own frame.
    pub rear: Vec<PosedScan>,
    /// What was wrong with the times; none of those written are used if there is anything.
    pub defects: TimeDefects,
}

/// Reads a CARMEN log.
///
/// # Errors
/// If the file is missing, cannot be unpacked, is not text, or a line lacks a field, has one that is no number or a time that
/// is not finite.
pub fn read(path: &Path) -> Result<CarmenLog, TextFileError> {
    let text = text_file::read_unpacked(path, "a CARMEN log")?;
    let mut lines = Vec::new();
    for (number, text) in (1..).zip(text.lines()) {
        let mut words = text.split_ascii_whitespace();
        let record = words.next().unwrap_or_default();
        let words = &mut words;
        let parsed = match record {
            "FLASER" => old_scan(words).map(|(scan, seconds)| (Record::Front(scan), seconds)),
            "RLASER" => old_scan(words).map(|(scan, seconds)| (Record::Rear(scan), seconds)),
            "ROBOTLASER1" => robot_laser(words).map(|(scan, seconds)| (Record::Front(scan), seconds)),
            "ROBOTLASER2" => robot_laser(words).map(|(scan, seconds)| (Record::Rear(scan), seconds)),
            "ODOM" => odometry(words).map(|(pose, seconds)| (Record::Odometry(pose), seconds)),
            _ => continue,
        };
        let (record, seconds) =
            parsed.ok_or_else(|| TextFileError::of_line(path, number, super::missing_field(record)))?;
        lines.push(TimedLine::new(seconds, record).ok_or_else(|| TextFileError::of_line(path, number, NOT_FINITE))?);
    }
    mark_anchors(&mut lines);
    Ok(CarmenLog::of_lines(lines))
}

impl CarmenLog {
    fn of_lines(lines: Vec<TimedLine>) -> Self {
        let (times, defects) = times(&lines);
        let mut log = Self { defects, ..Self::default() };
        let mut anchor = None;
        for (line, time) in lines.into_iter().zip(times) {
            match line.record {
                Record::Front(mut posed) => {
                    posed.scan.start = time;
                    log.front.scans.push(posed);
                }
                Record::Rear(mut posed) => {
                    posed.scan.start = time;
                    log.rear.push(posed);
                }
                Record::Odometry(pose) => {
                    let before: Option<Pose> = anchor.replace(pose);
                    let step = before.map(|before| PoseIncrement { time, displacement: before.between(&pose) });
                    log.front.increments.extend(step);
                }
                Record::Anchor(pose) => anchor = Some(pose),
            }
        }
        log
    }
}

/// Poses are repeated with six digits behind the point, or with all.
const SAME: f64 = 2e-6;

/// Finds the lines of odometry that repeat the corrected pose of the scan before them. In a log without such a line of time
/// zero, lines that repeat a pose are odometry that has not gone on since.
fn mark_anchors(lines: &mut [TimedLine]) {
    let mut repeats = Vec::new();
    let mut corrected: Option<Pose> = None;
    for (index, line) in lines.iter().enumerate() {
        match &line.record {
            Record::Front(posed) | Record::Rear(posed) => corrected = Some(posed.robot),
            Record::Odometry(pose) => {
                if corrected.take().is_some_and(|corrected| is_same(&corrected, pose)) {
                    repeats.push(index);
                }
            }
            Record::Anchor(_) => {}
        }
    }
    let is_corrected = repeats.iter().any(|index| lines[*index].seconds == 0.0)
        && lines.iter().any(|line| matches!(line.record, Record::Odometry(_)) && line.seconds > 0.0);
    if is_corrected {
        for index in repeats {
            if let Record::Odometry(pose) = lines[index].record {
                lines[index].record = Record::Anchor(pose);
            }
        }
    }
}

fn is_same(a: &Pose, b: &Pose) -> bool {
    (a.x - b.x).abs() < SAME && (a.y - b.y).abs() < SAME && (a.theta - b.theta).abs() < SAME
}

/// Fields: n, n ranges, laser pose, robot pose, time, host, time of logging. The angles are not written: half a turn,
/// of which both ends are measured if n is odd. Returns the scan, without its time, and that time, s.
fn old_scan<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<(PosedScan, f64)> {
    let ranges = ranges(words)?;
    let (laser, robot) = (pose(words)?, pose(words)?);
    let seconds = number(words)?;
    let steps = if ranges.len() % 2 == 1 { ranges.len() - 1 } else { ranges.len() };
    let step = std::f64::consts::PI / steps.max(1) as f64;
    Some((PosedScan { scan: scan(-std::f64::consts::FRAC_PI_2, step, ranges), laser, robot }, seconds))
}

/// Fields: robot pose, three values of its motion, time, host, time of logging.
fn odometry<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<(Pose, f64)> {
    let pose = pose(words)?;
    for _ in 0..3 {
        number(words)?;
    }
    Some((pose, number(words)?))
}
