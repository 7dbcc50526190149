//! Fields that CARMEN and pose-graph logs share: numbers, poses and the record of a laser. Lengths are in m, angles in rad.

use agv_core::geometry::Pose;
use agv_core::measurement::{LaserId, Time};

use super::PosedScan;
use crate::account::Account;
use crate::recording::RecordedScan;

pub(super) fn number<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<f64> {
    words.next()?.parse().ok()
}

/// A number that a pose can have.
fn finite<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<f64> {
    number(words).filter(|number| number.is_finite())
}

pub(super) fn count<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<usize> {
    words.next()?.parse().ok()
}

pub(super) fn pose<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<Pose> {
    Some(Pose::new(finite(words)?, finite(words)?, finite(words)?))
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

/// Ranges that are no numbers, or below zero, are no returns; says how many there were.
pub(super) fn tell_no_numbers(ranges: &mut [f32], account: &mut Account) {
    let mut bad = 0;
    for range in ranges.iter_mut().filter(|range| range.is_nan() || **range < 0.0) {
        *range = 0.0;
        bad += 1;
    }
    account.take(ranges.len() - bad);
    account.leave_out_some("ranges that are no numbers, or below zero", bad);
}

/// Steps are written with six digits or fewer: the last beam is off by less than this share of the field of view.
const ROUNDED: f64 = 0.01;

/// A head that `ROBOTLASER1` and `RAWLASER1` share: type, start angle, field of view, step, largest range, accuracy, remission mode, n,
/// n ranges, m, m remissions. The scan, without its time.
fn configured<'a>(words: &mut impl Iterator<Item = &'a str>, account: &mut Account) -> Option<RecordedScan> {
    number(words)?;
    let first_bearing = number(words)?;
    let field = number(words)?;
    let step = number(words)?;
    for _ in 0..3 {
        number(words)?;
    }
    let mut ranges = ranges(words)?;
    tell_no_numbers(&mut ranges, account);
    for _ in 0..count(words)? {
        number(words)?;
    }
    if !first_bearing.is_finite() || !step.is_finite() || !field.is_finite() {
        return None;
    }
    let step = step_of(step, field, ranges.len(), account);
    Some(scan(first_bearing, step, ranges))
}

/// The step between beams; what the field of view says if it is not written.
fn step_of(step: f64, field: f64, beams: usize, account: &mut Account) -> f64 {
    if beams < 2 || field == 0.0 {
        return step;
    }
    let (closed, open) = (field / (beams - 1) as f64, field / beams as f64);
    if step == 0.0 {
        account.warn("the step between beams is written as zero: it was made of the field of view");
        return closed;
    }
    let fits = |other: f64| (step / other - 1.0).abs() < ROUNDED;
    // Few beams with one missing at an end still fit neither.
    let tolerated = 2.0 * step.abs() + ROUNDED * field.abs();
    if !fits(closed) && !fits(open) && (step * (beams - 1) as f64 - field).abs() > tolerated {
        account.warn(format!(
            "{beams} beams a step of {:.3} deg apart do not fit a field of view of {:.1} deg: the step was believed",
            step.to_degrees(),
            field.to_degrees()
        ));
    }
    step
}

/// A `ROBOTLASER1` or `ROBOTLASER2` record behind its name. Fields: those of the scan, laser pose, robot pose, five values of the base,
/// time, host, time of logging. Returns the scan, without its time, and that time, s.
pub(super) fn robot_laser<'a>(
    words: &mut impl Iterator<Item = &'a str>,
    account: &mut Account,
) -> Option<(PosedScan, f64)> {
    let scan = configured(words, account)?;
    let (laser, robot) = (pose(words)?, pose(words)?);
    for _ in 0..5 {
        number(words)?;
    }
    let seconds = number(words)?;
    Some((PosedScan { scan, laser, robot }, seconds))
}

/// A `RAWLASER1` or `RAWLASER2` record behind its name. Fields: those of the scan, time, host, time of logging. Returns the scan, without
/// its time, and that time, s.
pub(super) fn raw_laser<'a>(
    words: &mut impl Iterator<Item = &'a str>,
    account: &mut Account,
) -> Option<(RecordedScan, f64)> {
    Some((configured(words, account)?, number(words)?))
}
