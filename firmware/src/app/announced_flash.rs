//! Flash that does not stop the vehicle unawares: where the processor stands still while a page is erased, the bus is told before; where it goes
//! on, the localiser reads no map of the same flash meanwhile.

use agv_settings::patient_flash::PatientFlash;
use embedded_storage::nor_flash::{ErrorType, ReadNorFlash};

use super::exchange;

/// How long the bus has for it, us: two of its steps, and what else waits for a bus of 125 kbit/s.
const NOTICE: u64 = 12_000;

/// A flash.
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

impl<F: PatientFlash> PatientFlash for AnnouncedFlash<F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), F::Error> {
        if self.is_announced {
            exchange::announce_pause(NOTICE).await;
        }
        exchange::begin_erasing().await;
        let outcome = self.flash.erase(from, to).await;
        exchange::end_erasing();
        outcome
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), F::Error> {
        self.flash.write(offset, bytes).await
    }

    async fn rest(&mut self) {
        self.flash.rest().await;
    }
}
