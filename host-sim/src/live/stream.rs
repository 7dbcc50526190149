//! The log stream of a controller, as a log.

use std::io::{self, Read};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use agv_core::record::{Item, Record};

use crate::log::{LogError, Reader, Writer};

/// Port of the log stream.
pub const PORT: u16 = 5350;

/// What a recording brought.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StreamSummary {
    /// Records, without those that a log begins with.
    pub records: usize,
    /// Places at which something is missing or damaged.
    pub damages: usize,
}

/// A connection that ends when it is told to.
struct Stoppable {
    stream: TcpStream,
    is_stopped: Arc<AtomicBool>,
}

impl Read for Stoppable {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while !self.is_stopped.load(Ordering::Relaxed) {
            match self.stream.read(buffer) {
                Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {}
                // A controller that starts again is no reason to lose what came before.
                Err(error) if error.kind() == io::ErrorKind::ConnectionReset => return Ok(0),
                outcome => return outcome,
            }
        }
        Ok(0)
    }
}

/// A log stream that is about to be read.
pub struct Connection {
    reader: Reader,
}

impl Connection {
    /// Connects to a controller. The stream ends when the controller ends it, or with `is_stopped`.
    ///
    /// # Errors
    /// If the controller cannot be reached, or what it says is no log.
    pub fn open(host: &str, is_stopped: &Arc<AtomicBool>) -> Result<Self, LogError> {
        let name = Path::new(host);
        let connect = || -> io::Result<TcpStream> {
            let stream = TcpStream::connect(host)?;
            stream.set_read_timeout(Some(Duration::from_millis(100)))?;
            Ok(stream)
        };
        let stream = connect().map_err(|source| LogError::Io { path: name.to_owned(), source })?;
        let source = Box::new(Stoppable { stream, is_stopped: Arc::clone(is_stopped) });
        Ok(Self { reader: Reader::of(name, source)? })
    }

    /// Calls `see` with the header and everything behind it, until the stream ends.
    ///
    /// # Errors
    /// If the connection breaks, or as `see` says.
    pub fn read(mut self, mut see: impl FnMut(Item) -> Result<(), LogError>) -> Result<(), LogError> {
        let mut has_header = false;
        while let Some(item) = self.reader.next()? {
            has_header |= matches!(item, Item::Record { record: Record::Header(_), .. });
            // Without a header nothing can be made of it.
            if has_header {
                see(item)?;
            }
        }
        Ok(())
    }
}

/// A log of what was streamed, with a note for each piece that is missing.
pub struct LogCopy {
    path: PathBuf,
    writer: Option<Writer>,
    set_aside: Option<PathBuf>,
    summary: StreamSummary,
}

impl LogCopy {
    /// A log that begins with the first header; an older file of that name then gets another one.
    #[must_use]
    pub fn new(path: &Path) -> Self {
        Self { path: path.to_owned(), writer: None, set_aside: None, summary: StreamSummary::default() }
    }

    /// The new name of an older file.
    #[must_use]
    pub fn set_aside(&self) -> Option<&Path> {
        self.set_aside.as_deref()
    }

    /// Adds what came.
    ///
    /// # Errors
    /// If the log cannot be written.
    pub fn take(&mut self, item: &Item) -> Result<(), LogError> {
        match (item, &mut self.writer) {
            (Item::Record { record: Record::Header(header), .. }, writer @ None) => {
                let mut begun = Writer::create(&self.path, header)?;
                // What comes is kept, whatever happens later.
                self.set_aside = begun.take_name()?;
                *writer = Some(begun);
                Ok(())
            }
            (Item::Record { record, .. }, Some(writer)) => {
                self.summary.records += usize::from(!matches!(record, Record::Landmarks(_)));
                writer.write(record)
            }
            (Item::Damage(damage), Some(writer)) => {
                self.summary.damages += 1;
                writer.write(&Record::Note(&format!("log stream: {damage}")))
            }
            (_, None) => Ok(()),
        }
    }

    /// Completes the log. None if there was no header.
    ///
    /// # Errors
    /// If the log cannot be written.
    pub fn finish(self) -> Result<Option<StreamSummary>, LogError> {
        let Self { writer, summary, .. } = self;
        writer.map(|writer| writer.finish().map(|()| summary)).transpose()
    }
}

/// Writes what a controller streams to a log, until the connection ends or `is_stopped`. `begun` is called when the
/// controller has said what it believes of its vehicle; `see` with each record, that one included.
///
/// # Errors
/// If the controller cannot be reached, what it says is no log, or the log cannot be written.
pub fn record_stream(
    host: &str,
    output: &Path,
    is_stopped: &Arc<AtomicBool>,
    mut begun: impl FnMut(),
    mut see: impl FnMut(&Record),
) -> Result<StreamSummary, LogError> {
    let mut copy = LogCopy::new(output);
    Connection::open(host, is_stopped)?.read(|item| {
        copy.take(&item)?;
        if let Item::Record { record, .. } = &item {
            if matches!(record, Record::Header(_)) {
                begun();
            }
            see(record);
        }
        Ok(())
    })?;
    copy.finish()?.ok_or_else(|| LogError::Empty { path: host.into() })
}
