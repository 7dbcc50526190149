//! The log stream of a controller, as a log.

use std::io::{self, Read};
use std::net::TcpStream;
use std::path::Path;
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

/// Writes what a controller streams to a log, until the connection ends or `is_stopped`. `begun` is called when the
/// controller has said what it believes of its vehicle; `see` with each record behind that.
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
    let name = Path::new(host);
    let connect = || -> io::Result<TcpStream> {
        let stream = TcpStream::connect(host)?;
        stream.set_read_timeout(Some(Duration::from_millis(100)))?;
        Ok(stream)
    };
    let stream = connect().map_err(|source| LogError::Io { path: name.to_owned(), source })?;
    let source = Box::new(Stoppable { stream, is_stopped: Arc::clone(is_stopped) });
    let mut reader = Reader::of(name, source)?;
    let mut writer: Option<Writer> = None;
    let mut summary = StreamSummary::default();
    while let Some(item) = reader.next()? {
        match (item, &mut writer) {
            (Item::Record { record: Record::Header(header), .. }, None) => {
                writer = Some(Writer::create(output, &header)?);
                begun();
            }
            (Item::Record { record, .. }, Some(writer)) => {
                if !matches!(record, Record::Landmarks(_)) {
                    summary.records += 1;
                }
                see(&record);
                writer.write(&record)?;
            }
            (Item::Damage(damage), Some(writer)) => {
                summary.damages += 1;
                writer.write(&Record::Note(&format!("log stream: {damage}")))?;
            }
            // Without a header nothing can be made of it.
            (_, None) => {}
        }
    }
    match writer {
        Some(writer) => writer.finish().map(|()| summary),
        None => Err(LogError::Empty { path: name.to_owned() }),
    }
}
