//! Fields that CARMEN and pose-graph logs share: numbers, poses and the record of a laser. Lengths are in m, angles in rad.

use agv_core::geometry::Pose;
use agv_core::measurement::{LaserId, Time};

use super::PosedScan;
use crate::recording::RecordedScan;

pub(super) fn number<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<f64> {
    words.next()?.parse().ok()
}

pub(super) fn count<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<usize> {
    words.next()?.parse().ok()
}

pub(super) fn pose<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<Pose> {
    Some(Pose::new(number(words)?, number(words)?, number(words)?))
}

pub(super) fn ranges<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<Vec<f32>> {
    (0..count(words)?).map(|_| number(words).map(|range| range as f32)).collect()
}

/// A scan whose time is not known yet.
pub(super) fn scan(first_bearing: f64, bearing_step: f64, ranges: Vec<f32>) -> RecordedScan {
    RecordedScan {
        laser: LaserId::FIRST,
        start: Time::default(),
        beam_interval: 0.0,
        first_bearing,
        bearing_step,
        ranges,
        intensities: Vec::new(),
    }
}

/// A `ROBOTLASER1` or `ROBOTLASER2` record behind its name. Fields: type, start angle, field of view, step, largest range, accuracy, remission mode, n, n ranges, m, m
/// remissions, laser pose, robot pose, five values of the base, time, host, time of logging. Returns the scan, without its time, and that
/// time, s.
pub(super) fn robot_laser<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<(PosedScan, f64)> {
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
    let seconds = number(words)?;
    Some((PosedScan { scan: scan(first_bearing, bearing_step, ranges), laser, robot }, seconds))
}
