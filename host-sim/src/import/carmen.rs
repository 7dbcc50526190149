//! CARMEN logs: lines of `FLASER`, `RLASER` and `ODOM` (old format) and `ROBOTLASER1`, `ROBOTLASER2` (new format), plain
//! or compressed with gzip.
//!
//! The poses of a scan are corrected ones if the log has been corrected. The logs of the SLAM benchmark repeat the
//! corrected pose after each scan as an `ODOM` line with time zero: from there the next `ODOM` lines go on by raw
//! odometry. Such a line moves the anchor and is no motion.

use std::path::Path;

use agv_core::geometry::Pose;
use agv_core::measurement::PoseIncrement;

use super::scan_record::{Clock, number, pose, ranges, robot_laser, scan};
use super::{PosedScan, ScanLog};
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
            "ROBOTLASER1" => robot_laser(words, &mut clock).map(|scan| log.front.scans.push(scan)),
            "ROBOTLASER2" => robot_laser(words, &mut clock).map(|scan| log.rear.push(scan)),
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

/// Fields: robot pose, three values of its motion, time, host, time of logging.
fn odometry<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<(Pose, f64)> {
    let pose = pose(words)?;
    for _ in 0..3 {
        number(words)?;
    }
    Some((pose, number(words)?))
}
