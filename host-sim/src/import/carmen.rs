//! CARMEN logs: lines of `FLASER`, `RLASER` and `ODOM` (old format) and `ROBOTLASER1`, `ROBOTLASER2` (new format), plain
//! or compressed with gzip.
//!
//! The poses of a scan are corrected ones if the log has been corrected. The logs of the SLAM benchmark repeat the
//! corrected pose after each scan as an `ODOM` line with time zero: from there the next `ODOM` lines go on by raw
//! odometry. Such a line moves the anchor and is no motion.

use std::path::Path;

use agv_core::geometry::Pose;
use agv_core::measurement::{PoseIncrement, Time};

use super::{PosedScan, ScanLog};
use crate::recording::RecordedScan;
use crate::text_file::{self, TextFileError};

/// A CARMEN log by laser.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CarmenLog {
    /// Scans of the front laser, and the odometry. Bearings are those of the laser that looks ahead.
    pub front: ScanLog,
    /// Scans of the rear laser, in the rear laser's own frame.
    pub rear: Vec<PosedScan>,
}

/// Reads a CARMEN log.
///
/// # Errors
/// If the file is missing, cannot be unpacked, is not text, or a line lacks a field or has one that is no number.
pub fn read(path: &Path) -> Result<CarmenLog, TextFileError> {
    let text = text_file::read_unpacked(path, "a CARMEN log")?;
    let mut log = CarmenLog::default();
    let mut clock = Clock::default();
    let mut anchor = None;
    for (line, text) in (1..).zip(text.lines()) {
        let mut words = text.split_ascii_whitespace();
        let record = words.next().unwrap_or_default();
        let words = &mut words;
        let parsed = match record {
            "FLASER" => old_scan(words, &mut clock).map(|scan| log.front.scans.push(scan)),
            "RLASER" => old_scan(words, &mut clock).map(|scan| log.rear.push(scan)),
            "ROBOTLASER1" => new_scan(words, &mut clock).map(|scan| log.front.scans.push(scan)),
            "ROBOTLASER2" => new_scan(words, &mut clock).map(|scan| log.rear.push(scan)),
            "ODOM" => odometry(words).map(|(pose, seconds)| {
                let before = anchor.replace(pose);
                if seconds > 0.0 {
                    let time = clock.at(seconds);
                    log.front.increments.extend(
                        before.map(|before| PoseIncrement { time, displacement: Pose::between(&before, &pose) }),
                    );
                }
            }),
            _ => Some(()),
        };
        parsed.ok_or_else(|| TextFileError::of_line(path, line, super::missing_field(record)))?;
    }
    Ok(log)
}

/// Times of a log count from its first one, in case they are seconds since 1970.
#[derive(Default)]
struct Clock {
    start: Option<f64>,
}

impl Clock {
    fn at(&mut self, seconds: f64) -> Time {
        let start = *self.start.get_or_insert(seconds);
        Time::from_seconds((seconds - start).max(0.0))
    }
}

fn number<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<f64> {
    words.next()?.parse().ok()
}

fn count<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<usize> {
    words.next()?.parse().ok()
}

fn pose<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<Pose> {
    Some(Pose::new(number(words)?, number(words)?, number(words)?))
}

fn ranges<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<Vec<f32>> {
    (0..count(words)?).map(|_| number(words).map(|range| range as f32)).collect()
}

fn scan(start: Time, first_bearing: f64, bearing_step: f64, ranges: Vec<f32>) -> RecordedScan {
    RecordedScan { start, beam_interval: 0.0, first_bearing, bearing_step, ranges, intensities: Vec::new() }
}

/// Fields: n, n ranges, laser pose, robot pose, time, host, time of logging. The angles are not written: half a turn,
/// of which both ends are measured if n is odd.
fn old_scan<'a>(words: &mut impl Iterator<Item = &'a str>, clock: &mut Clock) -> Option<PosedScan> {
    let ranges = ranges(words)?;
    let (laser, robot) = (pose(words)?, pose(words)?);
    let time = clock.at(number(words)?);
    let steps = if ranges.len() % 2 == 1 { ranges.len() - 1 } else { ranges.len() };
    let step = std::f64::consts::PI / steps.max(1) as f64;
    Some(PosedScan { scan: scan(time, -std::f64::consts::FRAC_PI_2, step, ranges), laser, robot })
}

/// Fields: type, start angle, field of view, step, largest range, accuracy, remission mode, n, n ranges, m, m
/// remissions, laser pose, robot pose, five values of the base, time, host, time of logging.
fn new_scan<'a>(words: &mut impl Iterator<Item = &'a str>, clock: &mut Clock) -> Option<PosedScan> {
    number(words)?;
    let first_bearing = number(words)?;
    number(words)?;
    let bearing_step = number(words)?;
    for _ in 0..3 {
        number(words)?;
    }
    let ranges = ranges(words)?;
    for _ in 0..count(words)? {
        number(words)?;
    }
    let (laser, robot) = (pose(words)?, pose(words)?);
    for _ in 0..5 {
        number(words)?;
    }
    let time = clock.at(number(words)?);
    Some(PosedScan { scan: scan(time, first_bearing, bearing_step, ranges), laser, robot })
}

/// Fields: robot pose, three values of its motion, time, host, time of logging.
fn odometry<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<(Pose, f64)> {
    let pose = pose(words)?;
    for _ in 0..3 {
        number(words)?;
    }
    Some((pose, number(words)?))
}
