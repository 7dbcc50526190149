//! A log as a file: that of a whole run, or a part that begins with all that was known.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use agv_core::maps::Landmark;
use agv_core::record::{Header, LANDMARKS_A_RECORD, MAX_FRAME, Record, StateOwner, StatePiece, encode};

use super::state_keeper::States;
use crate::log::LogError;
use crate::output_file::OutputFile;

/// Longest time between two moments at which everything is on the disk.
const FLUSH: Duration = Duration::from_secs(1);

/// What logs of a controller begin with.
#[derive(Clone, Copy)]
pub(super) struct Beginning<'a> {
    pub header: Header<'a>,
    pub landmarks: &'a [Landmark],
}

/// A log that is written in frames which somebody else has made. It has its name from the beginning; an older file of that name is
/// given another one.
pub(super) struct LogFile {
    path: PathBuf,
    file: OutputFile,
    sequence: u32,
    length: u64,
    flushed: Instant,
}

impl LogFile {
    /// Begins the log of a whole run.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn begin(path: &Path, beginning: &Beginning) -> Result<Self, LogError> {
        Self::create(path, beginning, 0)
    }

    /// Begins a log in the middle of a run, whose next frame has that number.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn go_on(path: &Path, beginning: &Beginning, states: &States, next: u32) -> Result<Self, LogError> {
        let pieces = || {
            let [localizer, predictor] = states.bytes();
            StatePiece::of(StateOwner::Localizer, localizer).chain(StatePiece::of(StateOwner::Predictor, predictor))
        };
        let before = beginning.frames().wrapping_add(pieces().count() as u32);
        let mut log = Self::create(path, beginning, next.wrapping_sub(before))?;
        pieces().try_for_each(|piece| log.write_record(&Record::State(piece)))?;
        Ok(log)
    }

    fn create(path: &Path, beginning: &Beginning, sequence: u32) -> Result<Self, LogError> {
        let io = |source| LogError::Io { path: path.to_owned(), source };
        let mut file = OutputFile::create(path).map_err(io)?;
        file.take_name().map_err(io)?;
        let mut log = Self { path: path.to_owned(), file, sequence, length: 0, flushed: Instant::now() };
        log.write_record(&Record::Header(beginning.header))?;
        let mut pieces = beginning.landmarks.chunks(LANDMARKS_A_RECORD);
        pieces.try_for_each(|piece| log.write_record(&Record::Landmarks(piece)))?;
        Ok(log)
    }

    fn io(&self, source: std::io::Error) -> LogError {
        LogError::Io { path: self.path.clone(), source }
    }

    fn write_record(&mut self, record: &Record) -> Result<(), LogError> {
        let mut frame = vec![0; MAX_FRAME];
        // Pieces of a map or of a state, and the header, are shorter than a frame may be.
        let length = encode(record, self.sequence, &mut frame).unwrap_or_default();
        self.write(&frame[..length])
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its bytes so far.
    pub const fn length(&self) -> u64 {
        self.length
    }

    /// The number of the next frame.
    pub const fn sequence(&self) -> u32 {
        self.sequence
    }

    /// Adds a frame.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&mut self, frame: &[u8]) -> Result<(), LogError> {
        self.sequence = self.sequence.wrapping_add(1);
        self.file.write_all(frame).map_err(|source| self.io(source))?;
        self.length += frame.len() as u64;
        if self.flushed.elapsed() >= FLUSH {
            self.flushed = Instant::now();
            self.file.sync().map_err(|source| self.io(source))?;
        }
        Ok(())
    }

    /// Brings everything to the system, for whoever reads the file.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn flush(&mut self) -> Result<(), LogError> {
        self.file.flush().map_err(|source| self.io(source))
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

impl Beginning<'_> {
    /// How many frames it takes.
    pub fn frames(&self) -> u32 {
        1 + self.landmarks.len().div_ceil(LANDMARKS_A_RECORD) as u32
    }
}
