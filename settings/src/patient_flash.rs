//! Flash whose work takes long, and leaves the processor to others meanwhile.

use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};

/// Flash that is read at once, and changed while others go on. One that has done its work when it returns is one, too.
pub trait PatientFlash: ReadNorFlash {
    /// Bytes that are written at once, as [`NorFlash::WRITE_SIZE`].
    const WRITE_SIZE: usize;
    /// Bytes that are erased at once, as [`NorFlash::ERASE_SIZE`].
    const ERASE_SIZE: usize;

    /// Erases from an offset up to another one. Dropped before its end, it leaves the flash as a loss of power would.
    fn erase(&mut self, from: u32, to: u32) -> impl Future<Output = Result<(), Self::Error>>;

    /// Writes bytes from an offset on.
    fn write(&mut self, offset: u32, bytes: &[u8]) -> impl Future<Output = Result<(), Self::Error>>;

    /// Lets others go on, if this has kept them waiting for long. Between two reads.
    fn rest(&mut self) -> impl Future<Output = ()> {
        core::future::ready(())
    }
}

impl<F: NorFlash> PatientFlash for F {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        NorFlash::erase(self, from, to)
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        NorFlash::write(self, offset, bytes)
    }
}
