//! What a NAV350 says, as a log.

use std::sync::atomic::{AtomicBool, Ordering};

use agv_core::localizer::Event;
use agv_core::measurement::Time;
use agv_core::record::{RawSource, Record};

use agv_wire::nav350::LostReason;

use super::{Limits, Recorder};
use crate::link::nav350::{Happening, Link};
use crate::log::LogError;

/// What a recording brought.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// Scans.
    pub scans: usize,
    /// Sets of reflectors.
    pub reflectors: usize,
    /// How often the connection was lost.
    pub lost: usize,
    /// Bytes that were received.
    pub received: usize,
    /// Why the connection was lost the last time.
    pub reason: Option<LostReason>,
}

impl Summary {
    /// Whether the sensor has measured nothing.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.scans == 0 && self.reflectors == 0
    }
}

/// How long the link is left alone before `is_stopped` is looked at, s.
const SLICE: f64 = 0.1;

/// Records what a NAV350 says until `limits`, `is_stopped` or `scans` scans: the bytes of both directions, what they mean, and a note of
/// everything that happened to the connection.
///
/// # Errors
/// If the log cannot be written. Failures of the sensor or the network are recorded.
pub fn record_nav350(
    link: &mut Link,
    limits: &Limits,
    scans: usize,
    is_stopped: &AtomicBool,
    recorder: &Recorder,
) -> Result<Summary, LogError> {
    let mut summary = Summary::default();
    while summary.scans < scans
        && !is_stopped.load(Ordering::Relaxed)
        && !limits.is_over(link.clock().now(), summary.is_empty())
    {
        let slice = link.clock().now().offset(SLICE * link.clock().speed()).min(limits.until);
        link.run(slice, |time, happening| record(recorder, &mut summary, time, happening))?;
    }
    Ok(summary)
}

fn record(recorder: &Recorder, summary: &mut Summary, time: Time, happening: Happening) -> Result<(), LogError> {
    match happening {
        Happening::Connected => {
            recorder.write_raw(RawSource::FromNav350, time, &[])?;
            recorder.write(&Record::Note("nav350: connected"))
        }
        Happening::Lost(reason) => {
            summary.lost += 1;
            summary.reason = Some(reason);
            recorder.write(&Record::Note(&format!("nav350: lost: {reason}")))
        }
        Happening::Report(report) => recorder.write(&Record::Note(&format!("nav350: {report}"))),
        Happening::Sent(bytes) => recorder.write_raw(RawSource::ToNav350, time, bytes),
        Happening::Received(bytes) => {
            summary.received += bytes.len();
            recorder.write_raw(RawSource::FromNav350, time, bytes)
        }
        Happening::Revolution(revolution) => {
            if let Some(reflectors) = revolution.reflectors() {
                summary.reflectors += 1;
                recorder.write(&Record::Event(Event::Reflectors(reflectors)))?;
            }
            if let Some(scan) = revolution.scan() {
                summary.scans += 1;
                recorder.write(&Record::Event(Event::Scan(scan)))?;
            }
            Ok(())
        }
    }
}
