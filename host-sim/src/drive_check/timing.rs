//! Whether the laser's times are those of the encoders.

use super::Finding;
use super::stream::Stream;
use super::times::{OTHER_CLOCK, late_at_arrival};
use super::vehicle::VehicleCheck;
use crate::calibrate::clock_offset::{ClockOffset, clock_offset};
use crate::calibrate::log_input::LogInput;
use crate::calibrate::wheeled::mistakes::WheelExplanation;
use crate::recording::{RecordedEvent, Recording};

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

/// The recording with the laser's times moved to those of the encoders, and by how much they were late, s: those of another clock by their
/// arrival first, then what the motion says. None if they are not off.
#[must_use]
pub fn moved(recording: &Recording) -> Option<(Recording, f64)> {
    let (mut right, mut late) = (recording.clone(), 0.0);
    if let Some(apart) = other_clock(recording) {
        move_laser(&mut right, apart);
        late += apart;
    }
    if let Some(rest) = late_by_motion(&right) {
        move_laser(&mut right, rest);
        late += rest;
    }
    (late != 0.0).then_some((right, late))
}

/// By how much the first laser is of another clock, s, if the log is in the order of arrival.
fn other_clock(recording: &Recording) -> Option<f64> {
    let streams = Stream::all(recording);
    let mut of_laser = streams.iter().filter(|stream| stream.source.laser().is_some());
    of_laser.find_map(late_at_arrival).filter(|late| late.abs() > OTHER_CLOCK)
}

fn late_by_motion(recording: &Recording) -> Option<f64> {
    let mut input = LogInput::of(recording);
    if let Some(offset) = put_right(&mut input) {
        return Some(offset.late);
    }
    let vehicle = VehicleCheck::new(recording, input, |_| ());
    let by_wheels = vehicle.by_wheels.iter().find_map(WheelExplanation::late);
    by_wheels.or_else(|| {
        let mut right = vehicle.mended()?;
        put_right(&mut right).map(|offset| offset.late)
    })
}

fn move_laser(recording: &mut Recording, late: f64) {
    for event in &mut recording.events {
        match event {
            RecordedEvent::Scan(scan) => scan.start = scan.start.offset(-late),
            RecordedEvent::Reflectors(seen) => {
                seen.observations.iter_mut().for_each(|one| one.time = one.time.offset(-late));
            }
            _ => {}
        }
    }
}
