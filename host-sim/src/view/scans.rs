//! Where the scans of a drive are: in the log's file, or the newest ones in memory.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::PathBuf;
use std::sync::Arc;

use agv_core::localizer::Event;
use agv_core::measurement::{Scan, Time};
use agv_core::record::{FrameReader, FrameStep, MAX_FRAME, Record, Scratch};

use crate::recording::RecordedScan;

/// Scans of a drive without a file that are kept: a quarter of an hour at 8 Hz.
const KEPT: usize = 7200;

/// Scans in order of time.
#[derive(Debug, Default)]
pub(super) struct Scans {
    file: Option<PathBuf>,
    /// Start of each scan, and where its record begins in the file.
    placed: Vec<(Time, u64)>,
    kept: VecDeque<Arc<RecordedScan>>,
    count: usize,
}

/// A scan that is to be fetched.
#[derive(Debug)]
pub(super) enum Found {
    InFile(PathBuf, u64),
    Kept(Arc<RecordedScan>),
}

impl Scans {
    pub(super) fn in_file(path: PathBuf) -> Self {
        Self { file: Some(path), ..Self::default() }
    }

    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Takes a scan whose record begins at that byte.
    pub(super) fn take(&mut self, scan: &Scan, offset: u64) {
        self.count += 1;
        if self.file.is_some() {
            self.placed.push((scan.start, offset));
            return;
        }
        if self.kept.len() == KEPT {
            self.kept.pop_front();
        }
        self.kept.push_back(Arc::new(scan.into()));
    }

    /// The last scan that began by then.
    pub(super) fn at(&self, time: Time) -> Option<Found> {
        match &self.file {
            Some(path) => {
                let after = self.placed.partition_point(|(start, _)| *start <= time);
                let (_, offset) = self.placed.get(after.checked_sub(1)?)?;
                Some(Found::InFile(path.clone(), *offset))
            }
            None => {
                let after = self.kept.partition_point(|scan| scan.start <= time);
                self.kept.get(after.checked_sub(1)?).map(|scan| Found::Kept(Arc::clone(scan)))
            }
        }
    }
}

impl Found {
    /// The scan; None if the file has changed meanwhile.
    pub(super) fn fetch(self) -> Option<Arc<RecordedScan>> {
        let (path, offset) = match self {
            Self::Kept(scan) => return Some(scan),
            Self::InFile(path, offset) => (path, offset),
        };
        let mut file = File::open(path).ok()?;
        file.seek(SeekFrom::Start(offset)).ok()?;
        let mut bytes = Vec::with_capacity(MAX_FRAME);
        file.take(MAX_FRAME as u64).read_to_end(&mut bytes).ok()?;
        let (_, FrameStep::Frame { frame, .. }) = FrameReader::new().step(&bytes, true) else { return None };
        let mut scratch: Box<Scratch<8192, 4096>> = Box::default();
        match frame.record(&mut scratch) {
            Ok(Record::Event(Event::Scan(scan))) => Some(Arc::new((&scan).into())),
            _ => None,
        }
    }
}
