//! Recording from live sensors.

use agv_core::localizer::Event;
use agv_core::measurement::Time;
use agv_core::record::{RAW_A_RECORD, Raw, RawSource, Record};

use crate::link::nav350::{Happening, Link};
use crate::log::{LogError, Writer};

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
}

/// Time between two moments at which everything is on the disk, s.
const FLUSH_INTERVAL: f64 = 1.0;

/// Records what a NAV350 says until `until`: the bytes of both directions, what they mean, and a note of everything that
/// happened to the connection. What is older than a second survives a loss of power.
///
/// # Errors
/// If the log cannot be written. Failures of the sensor or the network are recorded.
pub fn record_nav350(link: &mut Link, until: Time, writer: &mut Writer) -> Result<Summary, LogError> {
    let mut summary = Summary::default();
    let mut flushed = link.clock().now();
    link.run(until, |time, happening| {
        match happening {
            Happening::Connected => writer.write(&Record::Note("nav350: connected"))?,
            Happening::Lost(reason) => {
                summary.lost += 1;
                writer.write(&Record::Note(&format!("nav350: lost: {reason}")))?;
            }
            Happening::Report(report) => writer.write(&Record::Note(&format!("nav350: {report}")))?,
            Happening::Sent(bytes) => write_raw(writer, RawSource::ToNav350, time, bytes)?,
            Happening::Received(bytes) => {
                summary.received += bytes.len();
                write_raw(writer, RawSource::FromNav350, time, bytes)?;
            }
            Happening::Revolution(revolution) => {
                if let Some(reflectors) = revolution.reflectors() {
                    summary.reflectors += 1;
                    writer.write(&Record::Event(Event::Reflectors(reflectors)))?;
                }
                if let Some(scan) = revolution.scan() {
                    summary.scans += 1;
                    writer.write(&Record::Event(Event::Scan(scan)))?;
                }
            }
        }
        if time.since(flushed) >= FLUSH_INTERVAL {
            flushed = time;
            writer.flush()?;
        }
        Ok(())
    })?;
    Ok(summary)
}

fn write_raw(writer: &mut Writer, source: RawSource, time: Time, bytes: &[u8]) -> Result<(), LogError> {
    bytes.chunks(RAW_A_RECORD).try_for_each(|bytes| writer.write(&Record::Raw(Raw { source, time, bytes })))
}
