//! A `sensor_msgs/LaserScan` as a scan.

use agv_core::measurement::{LaserId, Time};

use crate::account::Account;
use crate::recording::RecordedScan;
use crate::ros::messages::LaserScan;

/// Drivers that tell the strength as a share of the largest one are told apart by that none is larger.
const SHARES: f32 = 1.0;
/// What the largest share becomes: of eight bits, as most scanners tell it.
const LARGEST_SHARE: f32 = 255.0;
/// The last beam may be one step from where the message says, and the step is rounded.
const STEPS: f64 = 1.5;

/// Strengths of all scans of a recording: the factor from the driver's unit to whole numbers.
pub(super) fn strength_factor<'a>(scans: impl Iterator<Item = &'a LaserScan>, account: &mut Account) -> f32 {
    let (mut largest, mut has_fractions) = (0.0_f32, false);
    for value in scans.flat_map(|scan| &scan.intensities).filter(|value| value.is_finite()) {
        largest = largest.max(*value);
        has_fractions |= value.fract() != 0.0;
    }
    if largest > f32::from(u16::MAX) {
        account.warn(format!("strengths up to {largest:.0} were scaled down to 65535"));
        f32::from(u16::MAX) / largest
    } else if largest > 0.0 && largest <= SHARES && has_fractions {
        account.note("strengths from 0 to 1 were taken as shares of 255");
        LARGEST_SHARE
    } else {
        1.0
    }
}

/// The scan that a message holds. None if it cannot be used; the account says why.
pub(super) fn scan(
    start: Time,
    message: &LaserScan,
    is_upside_down: bool,
    factor: f32,
    account: &mut Account,
) -> Option<RecordedScan> {
    let place = || format!("at {:.3} s", start.seconds());
    if message.ranges.is_empty() {
        account.leave_out("scans without beams", place());
        return None;
    }
    let Some(step) = step(message, account) else {
        account.leave_out("scans whose angles are no numbers, or all the same", place());
        return None;
    };
    // Seen from above, the bearings of what hangs upside down grow the other way.
    let sign = if is_upside_down { -1.0 } else { 1.0 };
    let strength = |value: &f32| (factor * value).round().clamp(0.0, f32::from(u16::MAX)) as u16;
    // A list of another length belongs to other beams.
    let has_strengths = message.intensities.len() == message.ranges.len();
    if !has_strengths && !message.intensities.is_empty() {
        account.warn("there are not as many strengths as ranges: they were left out");
    }
    let beam_interval = f64::from(message.time_increment);
    if !beam_interval.is_finite() || beam_interval < 0.0 {
        account.warn("the time between beams is no time: all beams were taken at the stamp");
    }
    account.take(1);
    Some(RecordedScan {
        laser: LaserId::FIRST,
        start,
        beam_interval: if beam_interval.is_finite() { beam_interval.max(0.0) } else { 0.0 },
        first_bearing: sign * f64::from(message.angle_min),
        bearing_step: sign * step,
        ranges: ranges(message, account),
        intensities: if has_strengths { message.intensities.iter().map(strength).collect() } else { Vec::new() },
    })
}

/// Ranges within the limits; others are no returns.
fn ranges(message: &LaserScan, account: &mut Account) -> Vec<f32> {
    let LaserScan { range_min, range_max, ranges, .. } = message;
    let are_limits = range_max > range_min;
    if !are_limits {
        account.warn(format!("the limits of ranges, {range_min} to {range_max} m, are none: all ranges were kept"));
    }
    let is_kept = |range: f32| {
        if are_limits { (*range_min..=*range_max).contains(&range) } else { range.is_finite() && range > 0.0 }
    };
    ranges.iter().map(|range| if is_kept(*range) { *range } else { 0.0 }).collect()
}

/// The angle between beams, rad; what first and last beam say where it was not filled in.
fn step(message: &LaserScan, account: &mut Account) -> Option<f64> {
    let (first, last, step) =
        (f64::from(message.angle_min), f64::from(message.angle_max), f64::from(message.angle_increment));
    let steps = message.ranges.len() - 1;
    if !first.is_finite() || !step.is_finite() {
        return None;
    }
    if steps == 0 {
        return Some(step);
    }
    if step == 0.0 {
        let made = (last - first) / steps as f64;
        account.warn("the angle between beams is zero: it was made of the first and the last beam's");
        return (made.is_finite() && made != 0.0).then_some(made);
    }
    let end = first + step * steps as f64;
    if last.is_finite() && (end - last).abs() > STEPS * step.abs() {
        account.warn(format!(
            "{} beams {:.3} deg apart end at {:.1} deg, not at {:.1} deg as the scans say: the angle between beams was believed",
            message.ranges.len(),
            step.to_degrees(),
            end.to_degrees(),
            last.to_degrees()
        ));
    }
    Some(step)
}
