//! The log of a whole run as a file.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use agv_core::maps::Landmark;
use agv_core::record::{Header, LANDMARKS_A_RECORD, MAX_FRAME, Record, encode};

use crate::log::LogError;
use crate::output_file::OutputFile;

/// Longest time between two moments at which everything is on the disk.
const FLUSH: Duration = Duration::from_secs(1);

/// A log that is written in frames which somebody else has made. It has its name from the beginning; an older file of that name is
/// given another one.
pub(super) struct LogFile {
    path: PathBuf,
    file: OutputFile,
    sequence: u32,
    flushed: Instant,
}

impl LogFile {
    /// Begins the log of a vehicle with a map.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn begin(path: &Path, header: &Header, landmarks: &[Landmark]) -> Result<Self, LogError> {
        let io = |source| LogError::Io { path: path.to_owned(), source };
        let mut file = OutputFile::create(path).map_err(io)?;
        file.take_name().map_err(io)?;
        let mut log = Self { path: path.to_owned(), file, sequence: 0, flushed: Instant::now() };
        log.write_record(&Record::Header(*header))?;
        landmarks.chunks(LANDMARKS_A_RECORD).try_for_each(|piece| log.write_record(&Record::Landmarks(piece)))?;
        Ok(log)
    }

    fn io(&self, source: std::io::Error) -> LogError {
        LogError::Io { path: self.path.clone(), source }
    }

    fn write_record(&mut self, record: &Record) -> Result<(), LogError> {
        let mut frame = vec![0; MAX_FRAME];
        // Pieces of a map, and the header, are shorter than a frame may be.
        let length = encode(record, self.sequence, &mut frame).unwrap_or_default();
        self.write(&frame[..length])
    }

    /// Adds a frame.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&mut self, frame: &[u8]) -> Result<(), LogError> {
        self.sequence = self.sequence.wrapping_add(1);
        self.file.write_all(frame).map_err(|source| self.io(source))?;
        if self.flushed.elapsed() >= FLUSH {
            self.flushed = Instant::now();
            self.file.sync().map_err(|source| self.io(source))?;
        }
        Ok(())
    }

    /// Says that it is complete, and brings it to the disk.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn finish(mut self) -> Result<(), LogError> {
        self.write_record(&Record::End)?;
        self.file.sync().map_err(|source| self.io(source))?;
        let Self { path, file, .. } = self;
        file.finish().map_err(|source| LogError::Io { path, source })
    }
}
