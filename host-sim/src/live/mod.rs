//! Recording from live sensors.

mod can;
mod nav350;
pub mod relay;
pub mod stream;

use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use agv_core::localizer::Event;
use agv_core::measurement::Time;
use agv_core::record::{Raw, RawSource, Record};

pub use can::{CanSummary, record_can};
pub use nav350::{Summary, record_nav350};

use crate::bus::BusError;
use crate::import::raw::pieces;
use crate::log::{LogError, Writer};

/// When a recording ends by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Then.
    pub until: Time,
    /// Then, if nothing has come by then.
    pub first: Time,
}

impl Limits {
    /// Until then, whatever comes.
    #[must_use]
    pub fn until(until: Time) -> Self {
        Self { until, first: Time::from_micros(u64::MAX) }
    }

    fn is_over(&self, now: Time, is_empty: bool) -> bool {
        now >= self.until || is_empty && now >= self.first
    }
}

/// Why a recording ended.
#[derive(Debug, thiserror::Error)]
pub enum LiveError {
    /// The log cannot be written.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The bus cannot be used.
    #[error(transparent)]
    Bus(#[from] BusError),
}

/// Longest time between two moments at which everything is on the disk.
const FLUSH_INTERVAL: Duration = Duration::from_secs(1);

/// A log that several sensors write to. It takes its name with the first datum, and an older file of that name then gets
/// another one; from then on, what is older than a second survives a loss of power.
pub struct Recorder {
    inner: Mutex<Inner>,
}

struct Inner {
    writer: Writer,
    flushed: Instant,
    has_data: bool,
    set_aside: Option<PathBuf>,
}

/// Whether a record is what a sensor measured, or any frame of a bus; not what was said to no end.
fn is_datum(record: &Record) -> bool {
    match record {
        Record::Event(event) => !matches!(event, Event::EncoderFaults(_)),
        Record::Raw(raw) => raw.source == RawSource::FromCan && !raw.bytes.is_empty(),
        _ => false,
    }
}

impl Recorder {
    /// A recorder that goes on with a log.
    #[must_use]
    pub fn new(writer: Writer) -> Self {
        Self { inner: Mutex::new(Inner { writer, flushed: Instant::now(), has_data: false, set_aside: None }) }
    }

    fn inner(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a record.
    ///
    /// # Errors
    /// If the record is too long, or the file cannot be written.
    pub fn write(&self, record: &Record) -> Result<(), LogError> {
        let mut inner = self.inner();
        inner.writer.write(record)?;
        if !inner.has_data && is_datum(record) {
            inner.has_data = true;
            inner.set_aside = inner.writer.take_name()?;
        }
        if inner.flushed.elapsed() >= FLUSH_INTERVAL {
            inner.flushed = Instant::now();
            inner.writer.flush()?;
        }
        Ok(())
    }

    /// Adds bytes as they passed a link, in pieces if they are many.
    fn write_raw(&self, source: RawSource, time: Time, bytes: &[u8]) -> Result<(), LogError> {
        pieces(bytes).try_for_each(|bytes| self.write(&Record::Raw(Raw { source, time, bytes })))
    }

    /// Whether a datum has come.
    #[must_use]
    pub fn has_data(&self) -> bool {
        self.inner().has_data
    }

    /// The new name of an older file.
    #[must_use]
    pub fn set_aside(&self) -> Option<PathBuf> {
        self.inner().set_aside.clone()
    }

    /// Says that the log is complete. A recorder that is dropped instead leaves no file if there was no datum.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn finish(self) -> Result<(), LogError> {
        self.inner.into_inner().unwrap_or_else(PoisonError::into_inner).writer.finish()
    }
}
