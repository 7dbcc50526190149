//! Times of a log's lines, or times made from their order where what is written cannot be.

use std::fmt;

use agv_core::geometry::Pose;
use agv_core::measurement::Time;

use super::PosedScan;

/// Between two lines of odometry whose times are made, or two scans where there is no odometry, s.
pub const STEP: f64 = 0.2;

/// A scan is logged within this time of the lines of odometry beside it, s.
const LATEST: f64 = 0.5;

/// One line that has a time.
pub(super) struct TimedLine {
    /// As written, s.
    pub(super) seconds: f64,
    /// What happened.
    pub(super) record: Record,
}

impl TimedLine {
    /// None if the time is not finite.
    pub(super) fn new(seconds: f64, record: Record) -> Option<Self> {
        seconds.is_finite().then_some(Self { seconds, record })
    }
}

/// What is said of a line whose time is not finite.
pub(super) const NOT_FINITE: &str = "the time is not finite";

/// What a line tells.
pub(super) enum Record {
    /// A scan of the front laser.
    Front(PosedScan),
    /// A scan of the rear laser.
    Rear(PosedScan),
    /// Pose of the robot by its odometry.
    Odometry(Pose),
    /// Corrected pose of the scan before, from which odometry goes on: it happens at no time.
    Anchor(Pose),
}

/// What is wrong with the times of a log, in numbers of lines.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TimeDefects {
    /// Lines whose time is earlier than that of the line of their kind before.
    pub backward: usize,
    /// Scans of one time, and lines of odometry that move in none.
    pub equal: usize,
    /// Lines of time zero behind lines with a time.
    pub zero: usize,
    /// Scans whose time is far from that of the odometry beside them.
    pub apart: usize,
}

impl TimeDefects {
    /// Whether times are as they should be.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }
}

impl fmt::Display for TimeDefects {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        let Self { backward, equal, zero, apart } = self;
        write!(
            formatter,
            "the times of {backward} lines go back, of {equal} repeat, of {zero} are zero, of {apart} are far from the \
             odometry's: all times are made from the order of the lines, {STEP} s a line of odometry, or a scan where there \
             is none"
        )
    }
}

/// Time of each line, and what was wrong with those that are written; if there is anything, none of them is used.
pub(super) fn times(lines: &[TimedLine]) -> (Vec<Time>, TimeDefects) {
    let defects = defects(lines);
    (if defects.is_none() { as_written(lines) } else { by_order(lines) }, defects)
}

fn defects(lines: &[TimedLine]) -> TimeDefects {
    let mut defects = TimeDefects::default();
    let (mut odometry, mut front, mut rear): (Option<(f64, Pose)>, _, _) = (None, None, None);
    // The last scan waits for the line of odometry behind it.
    let mut waiting: Option<f64> = None;
    for line in lines {
        let seconds = line.seconds;
        let before = match &line.record {
            Record::Anchor(pose) => {
                odometry = odometry.map(|(before, _)| (before, *pose));
                continue;
            }
            Record::Odometry(pose) => {
                defects.apart += usize::from(waiting.take().is_some_and(|scan| scan > seconds + LATEST));
                let before = odometry.replace((seconds, *pose));
                // A robot that stands still may say so twice.
                before.filter(|(before, stood)| *before != seconds || stood != pose).map(|(before, _)| before)
            }
            Record::Front(_) | Record::Rear(_) => {
                defects.apart += usize::from(odometry.is_some_and(|(before, _)| seconds < before - LATEST));
                waiting = Some(seconds);
                let is_front = matches!(line.record, Record::Front(_));
                if is_front { &mut front } else { &mut rear }.replace(seconds)
            }
        };
        let Some(before) = before else { continue };
        if seconds == 0.0 && before > 0.0 {
            defects.zero += 1;
        } else if seconds < before {
            defects.backward += 1;
        } else if seconds == before {
            defects.equal += 1;
        }
    }
    defects
}

/// The times as written, from the first on.
fn as_written(lines: &[TimedLine]) -> Vec<Time> {
    let timed = lines.iter().filter(|line| !matches!(line.record, Record::Anchor(_)));
    let start = timed.map(|line| line.seconds).min_by(f64::total_cmp).unwrap_or_default();
    lines.iter().map(|line| Time::from_seconds(line.seconds - start)).collect()
}

/// Times by the order of the lines: each line of odometry is a step later than the one before, and scans are at the one
/// before them, a microsecond apart. Where there is no odometry, scans are a step apart.
fn by_order(lines: &[TimedLine]) -> Vec<Time> {
    let has_odometry = lines.iter().any(|line| matches!(line.record, Record::Odometry(_)));
    let (mut steps, mut scans) = (0_u64, 0_u64);
    let step = (STEP * 1e6) as u64;
    let time = |line: &TimedLine| {
        match line.record {
            Record::Odometry(_) => (steps, scans) = (steps + 1, 0),
            Record::Front(_) | Record::Rear(_) if has_odometry => scans += 1,
            Record::Front(_) | Record::Rear(_) => steps += 1,
            Record::Anchor(_) => {}
        }
        Time::from_micros(steps * step + scans.saturating_sub(1))
    };
    lines.iter().map(time).collect()
}
