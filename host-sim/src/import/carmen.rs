//! CARMEN logs: lines of `FLASER`, `RLASER` and `ODOM` (old format), `ROBOTLASER1`, `ROBOTLASER2` (new format), and `RAWLASER1`,
//! `RAWLASER2` where a laser has no others, plain or compressed with gzip.
//!
//! The poses of a scan are corrected ones if the log has been corrected. The logs of the SLAM benchmark repeat the
//! corrected pose after each scan as an `ODOM` line, most of them with time zero: from there the next `ODOM` lines go on by
//! raw odometry. Such a line moves the anchor and is no motion. A `RAWLASER1` line tells no poses: they are those of the odometry before
//! it.
//!
//! Times are seconds, but some logs hold rounded ones, none, or a mixture of two clocks. If the times of a log contradict
//! the order of its lines, all of them are made from that order, and `CarmenLog::defects` says so. A log that ends in the middle of a line
//! is read up to there.

use std::path::Path;

use agv_core::geometry::Pose;
use agv_core::measurement::PoseIncrement;

use super::carmen_parameters::LaserParameters;
pub use super::line_times::TimeDefects;
use super::line_times::{NOT_FINITE, Record, TimedLine, times};
use super::scan_record::{number, pose, ranges, raw_laser, robot_laser, scan};
use super::{PosedScan, ScanLog};
use crate::account::Account;
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
    /// What was left out, assumed and doubtful, without the times.
    pub account: Account,
}

/// Reads a CARMEN log. `field_of_view` is that of the `FLASER` and `RLASER` lines, rad, where the log is not to be believed.
///
/// # Errors
/// If the file is missing, cannot be unpacked, is not text, or a line lacks a field, has one that is no number or a time that
/// is not finite.
pub fn read_with(path: &Path, field_of_view: Option<f64>) -> Result<CarmenLog, TextFileError> {
    let text = text_file::read_unpacked_as_far(path, "a CARMEN log")?;
    let mut account = Account::default();
    if text.is_cut {
        account.warn("the compressed file ends early: it was read up to there");
    }
    let mut reader = Reader::new(&text.text, field_of_view);
    let mut all: Vec<(usize, &str)> = (1..).zip(text.text.lines()).collect();
    if let Some((number, _)) = all.pop_if(|(_, last)| !text.text.ends_with('\n') && reader.is_cut(last)) {
        account.warn(format!("the file ends in the middle of line {number}: it was read up to there"));
    }
    let mut lines = Vec::new();
    for (number, text) in all {
        let record = text.split_ascii_whitespace().next().unwrap_or_default();
        let Some(parsed) = reader.line(record, text, &mut account) else { continue };
        let (record, seconds) =
            parsed.ok_or_else(|| TextFileError::of_line(path, number, super::missing_field(record)))?;
        lines.push(TimedLine::new(seconds, record).ok_or_else(|| TextFileError::of_line(path, number, NOT_FINITE))?);
    }
    mark_anchors(&mut lines);
    reader.tell(&mut account);
    Ok(CarmenLog { account, ..CarmenLog::of_lines(lines) })
}

/// The same, as the log says of itself.
///
/// # Errors
/// As [`read_with`].
pub fn read(path: &Path) -> Result<CarmenLog, TextFileError> {
    read_with(path, None)
}

/// What the lines before say of those behind.
struct Reader {
    /// Of the front laser and the rear one.
    lasers: [LaserParameters; 2],
    field_of_view: Option<f64>,
    /// Whether that laser has lines that tell its poses.
    has_posed: [bool; 2],
    /// By the last line of odometry.
    robot: Pose,
    raw: usize,
}

impl Reader {
    fn new(text: &str, field_of_view: Option<f64>) -> Self {
        let has = |records: [&str; 2]| {
            let record = |line: &str| line.split_ascii_whitespace().next().is_some_and(|word| records.contains(&word));
            text.lines().any(record)
        };
        Self {
            lasers: LaserParameters::first(text),
            field_of_view,
            has_posed: [has(["FLASER", "ROBOTLASER1"]), has(["RLASER", "ROBOTLASER2"])],
            robot: Pose::default(),
            raw: 0,
        }
    }

    /// What a line holds, and its time. The outer none for a line that is not used, the inner one for a bad line.
    fn line(&mut self, record: &str, text: &str, account: &mut Account) -> Option<Option<(Record, f64)>> {
        let words = &mut text.split_ascii_whitespace().skip(1);
        Some(match record {
            "FLASER" => self.old_scan(0, words, account).map(|(scan, seconds)| (Record::Front(scan), seconds)),
            "RLASER" => self.old_scan(1, words, account).map(|(scan, seconds)| (Record::Rear(scan), seconds)),
            "ROBOTLASER1" => robot_laser(words, account).map(|(scan, seconds)| (Record::Front(scan), seconds)),
            "ROBOTLASER2" => robot_laser(words, account).map(|(scan, seconds)| (Record::Rear(scan), seconds)),
            "RAWLASER1" if !self.has_posed[0] => {
                self.raw_scan(0, words, account).map(|(scan, seconds)| (Record::Front(scan), seconds))
            }
            "RAWLASER2" if !self.has_posed[1] => {
                self.raw_scan(1, words, account).map(|(scan, seconds)| (Record::Rear(scan), seconds))
            }
            "ODOM" => odometry(words).map(|(pose, seconds)| {
                self.robot = pose;
                (Record::Odometry(pose), seconds)
            }),
            "PARAM" => {
                LaserParameters::take(&mut self.lasers, text);
                return None;
            }
            "RAWLASER1" | "RAWLASER2" => {
                account.set_aside("RAWLASER lines of lasers whose scans are there with their poses", 1);
                return None;
            }
            "RAWLASER3" | "RAWLASER4" => {
                account.set_aside("scans of a third and a fourth laser", 1);
                return None;
            }
            _ => return None,
        })
    }

    /// Whether a last line that ends in no line end was cut: fields are missing, or those behind the time, which all lines have.
    fn is_cut(&self, text: &str) -> bool {
        const RECORDS: [&str; 7] = ["FLASER", "RLASER", "ROBOTLASER1", "ROBOTLASER2", "RAWLASER1", "RAWLASER2", "ODOM"];
        let record = text.split_ascii_whitespace().next().unwrap_or_default();
        if !RECORDS.contains(&record) {
            return true;
        }
        let words = &mut text.split_ascii_whitespace().skip(1);
        let account = &mut Account::default();
        let found = match record {
            "ODOM" => odometry(words).is_some(),
            "FLASER" | "RLASER" => old_fields(words).is_some(),
            "RAWLASER1" | "RAWLASER2" => raw_laser(words, account).is_some(),
            _ => robot_laser(words, account).is_some(),
        };
        // The host, and the time at which it was logged.
        !found || words.next().is_none() || words.next().is_none()
    }

    /// Fields: n, n ranges, laser pose, robot pose, time, host, time of logging. The angles are not written: see
    /// [`LaserParameters::beams`]. Returns the scan, without its time, and that time, s.
    fn old_scan<'a>(
        &self,
        laser: usize,
        words: &mut impl Iterator<Item = &'a str>,
        account: &mut Account,
    ) -> Option<(PosedScan, f64)> {
        let (mut ranges, laser_pose, robot, seconds) = old_fields(words)?;
        super::scan_record::tell_no_numbers(&mut ranges, account);
        let (first, step) = self.lasers[laser].beams(ranges.len(), self.field_of_view, account);
        Some((PosedScan { scan: scan(first, step, ranges), laser: laser_pose, robot }, seconds))
    }

    /// A scan that stands where the parameters say on a robot that stands where its odometry says.
    fn raw_scan<'a>(
        &mut self,
        laser: usize,
        words: &mut impl Iterator<Item = &'a str>,
        account: &mut Account,
    ) -> Option<(PosedScan, f64)> {
        let (scan, seconds) = raw_laser(words, account)?;
        self.raw += 1;
        let laser = self.robot.compose(&self.lasers[laser].place);
        Some((PosedScan { scan, laser, robot: self.robot }, seconds))
    }

    fn tell(&self, account: &mut Account) {
        if self.raw > 0 {
            account
                .note(format!("{} RAWLASER lines tell no poses: they are those of the odometry before them", self.raw));
            if !self.lasers.iter().any(|laser| laser.has_place) {
                account.note("no PARAM says where the laser is on the robot: it was taken to be in its middle");
            }
        }
    }
}

/// Ranges, pose of the laser, pose of the robot, and time.
fn old_fields<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<(Vec<f32>, Pose, Pose, f64)> {
    Some((ranges(words)?, pose(words)?, pose(words)?, number(words)?))
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

/// Fields: robot pose, three values of its motion, time, host, time of logging.
fn odometry<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<(Pose, f64)> {
    let pose = pose(words)?;
    for _ in 0..3 {
        number(words)?;
    }
    Some((pose, number(words)?))
}
