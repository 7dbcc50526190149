//! Recording from live sensors.

mod can;
mod nav350;
pub mod relay;
pub mod stream;

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use agv_core::measurement::Time;
use agv_core::record::{Raw, RawSource, Record};

pub use can::{CanSummary, record_can};
pub use nav350::{Summary, record_nav350};

use crate::bus::BusError;
use crate::import::raw::pieces;
use crate::log::{LogError, Writer};

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

/// A log that several sensors write to. What is older than a second survives a loss of power.
pub struct Recorder {
    inner: Mutex<Inner>,
}

struct Inner {
    writer: Writer,
    flushed: Instant,
}

impl Recorder {
    /// A recorder that goes on with a log.
    #[must_use]
    pub fn new(writer: Writer) -> Self {
        Self { inner: Mutex::new(Inner { writer, flushed: Instant::now() }) }
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

    /// Says that the log is complete.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn finish(self) -> Result<(), LogError> {
        self.inner.into_inner().unwrap_or_else(PoisonError::into_inner).writer.finish()
    }
}
