//! Logs of the machine that emulates the board.

use agv_core::record::{Item, LogReader, MAX_FRAME, Record, Scratch, Step};

use super::host_file::{HostFile, HostFileError};

/// Room for reading a log.
pub struct LogBuffer {
    bytes: [u8; 2 * MAX_FRAME],
    scratch: Scratch<1440, 256>,
}

impl LogBuffer {
    /// Empty room.
    #[must_use]
    pub const fn new() -> Self {
        Self { bytes: [0; 2 * MAX_FRAME], scratch: Scratch::new() }
    }

    /// Calls `take` with every good record of a log; returns how many places were damaged.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn for_each(&mut self, file: &mut HostFile, mut take: impl FnMut(&Record)) -> Result<usize, HostFileError> {
        let mut reader = LogReader::new();
        let (mut start, mut end, mut is_last, mut damages) = (0, 0, false, 0);
        loop {
            if end - start < MAX_FRAME && !is_last {
                self.bytes.copy_within(start..end, 0);
                (start, end) = (0, end - start);
                let count = file.read(&mut self.bytes[end..])?;
                is_last = count == 0;
                end += count;
            }
            let (consumed, step) = reader.step(&self.bytes[start..end], is_last, &mut self.scratch);
            start += consumed;
            match step {
                Step::Item(Item::Record { record, .. }) => take(&record),
                Step::Item(Item::Damage(_)) => damages += 1,
                Step::NeedMore => {}
                Step::End => return Ok(damages),
            }
        }
    }
}

impl Default for LogBuffer {
    fn default() -> Self {
        Self::new()
    }
}
