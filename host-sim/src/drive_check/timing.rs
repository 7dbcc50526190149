//! Whether what is measured carries the right times.

use agv_core::measurement::Time;

use super::Finding;
use crate::calibrate::clock_offset::{ClockOffset, clock_offset};
use crate::calibrate::log_input::LogInput;
use crate::recording::{RecordedEvent, Recording};

/// Longest gap of the encoders that the localiser bridges, s.
const LONGEST_GAP: f64 = 0.1;

/// Gaps of the encoders, and samples that do not come in their turn.
pub(super) fn gaps(recording: &Recording, log: &str) -> Option<Finding> {
    let encoders = recording.events.iter().filter(|event| matches!(event, RecordedEvent::Encoders(_)));
    let times: Vec<Time> = encoders.filter_map(RecordedEvent::time).collect();
    let gaps = || times.windows(2).map(|pair| pair[1].since(pair[0]));
    let back = gaps().filter(|gap| *gap < 0.0).count();
    let long = gaps().filter(|gap| *gap > LONGEST_GAP).count();
    if back + long == 0 {
        return None;
    }
    let longest = gaps().fold(0.0, f64::max);
    Some(Finding::new(
        format!("the encoders leave {long} gaps, the longest of {longest:.2} s, and go back in time {back} times"),
        format!("look at the bus and its load: agv view {log}"),
    ))
}

/// Moves the laser's times to those of the encoders if they are off, and tells by how much they were.
pub(super) fn put_right(input: &mut LogInput) -> Option<ClockOffset> {
    let offset = clock_offset(input).filter(ClockOffset::is_clear)?;
    for seen in input.revolutions.iter_mut().flatten() {
        seen.time = seen.time.offset(-offset.late);
    }
    Some(offset)
}

pub(super) fn finding(offset: &ClockOffset, log: &str) -> Finding {
    let [late, deviation] = [1e3 * offset.late.abs(), 1e3 * offset.deviation];
    let side = if offset.late > 0.0 { "late" } else { "early" };
    Finding::new(
        format!("the laser's times are {late:.0} ms too {side} for the encoders, give or take {deviation:.1} ms"),
        format!(
            "look at what gives them their times; this log can be mended: agv check {log} --put-right mended.agvlog"
        ),
    )
}

/// The recording with the laser's times moved to those of the encoders. None if they are not off.
#[must_use]
pub fn moved(recording: &Recording) -> Option<(Recording, ClockOffset)> {
    let mut input = LogInput::of(recording);
    let offset = put_right(&mut input)?;
    let mut right = recording.clone();
    for event in &mut right.events {
        match event {
            RecordedEvent::Scan(scan) => scan.start = scan.start.offset(-offset.late),
            RecordedEvent::Reflectors(seen) => {
                seen.observations.iter_mut().for_each(|one| one.time = one.time.offset(-offset.late));
            }
            _ => {}
        }
    }
    Some((right, offset))
}
