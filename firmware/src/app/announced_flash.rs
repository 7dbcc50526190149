//! Flash whose erasure is told to the bus before: the processor stands still for as long as it takes, and with it the pose.

use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};

use super::exchange;

/// How long the bus has for it, us: two of its steps, and what else waits for a bus of 125 kbit/s.
const NOTICE: u64 = 12_000;

/// A flash. What writes to it runs below the tasks of the bus.
pub struct AnnouncedFlash<F> {
    flash: F,
    is_announced: bool,
}

impl<F> AnnouncedFlash<F> {
    /// Announces what `flash` does, if the processor stands still meanwhile.
    #[must_use]
    pub const fn new(flash: F, stands_still: bool) -> Self {
        Self { flash, is_announced: stands_still }
    }
}

impl<F: ErrorType> ErrorType for AnnouncedFlash<F> {
    type Error = F::Error;
}

impl<F: ReadNorFlash> ReadNorFlash for AnnouncedFlash<F> {
    const READ_SIZE: usize = F::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), F::Error> {
        self.flash.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.flash.capacity()
    }
}

impl<F: NorFlash> NorFlash for AnnouncedFlash<F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), F::Error> {
        if self.is_announced {
            exchange::announce_pause(NOTICE);
        }
        self.flash.erase(from, to)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), F::Error> {
        self.flash.write(offset, bytes)
    }
}
