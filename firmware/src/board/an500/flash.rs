//! The flash of the emulated board: files in the emulating machine's folder, `flash.bin` of the settings and `contours.bin` of the map of
//! contours, with the pages and words of the STM32H743.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

use super::host_file::{HostFile, HostFileError};

/// Bytes of a page.
pub const PAGE: usize = 128 * 1024;
/// Pages of a file.
const PAGES: usize = 2;
/// Bytes of a word.
const WORD: usize = 32;

/// The flash.
pub struct FileFlash {
    file: Result<HostFile, HostFileError>,
}

/// It was not done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlashError(NorFlashErrorKind);

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        self.0
    }
}

impl From<HostFileError> for FlashError {
    fn from(_: HostFileError) -> Self {
        Self(NorFlashErrorKind::Other)
    }
}

impl FileFlash {
    /// Opens the file; makes it, erased, if there is none.
    #[must_use]
    pub fn open(name: &core::ffi::CStr) -> Self {
        if let Ok(file) = HostFile::open_to_change(name) {
            return Self { file: Ok(file) };
        }
        if let Ok(mut file) = HostFile::create(name) {
            for _ in 0..PAGES * PAGE / ERASED.len() {
                let _ = file.write(&ERASED);
            }
        }
        Self { file: HostFile::open_to_change(name) }
    }

    fn at(&mut self, offset: usize) -> Result<&mut HostFile, FlashError> {
        let file = self.file.as_mut().map_err(|error| *error)?;
        file.seek(offset)?;
        Ok(file)
    }
}

static ERASED: [u8; 1024] = [0xFF; 1024];

impl ErrorType for FileFlash {
    type Error = FlashError;
}

impl ReadNorFlash for FileFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        check_read(self, offset, bytes.len()).map_err(FlashError)?;
        let count = self.at(offset as usize)?.read(bytes)?;
        if count == bytes.len() { Ok(()) } else { Err(FlashError(NorFlashErrorKind::Other)) }
    }

    fn capacity(&self) -> usize {
        PAGES * PAGE
    }
}

impl NorFlash for FileFlash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        check_erase(self, from, to).map_err(FlashError)?;
        let file = self.at(from as usize)?;
        for _ in 0..(to - from) as usize / ERASED.len() {
            file.write(&ERASED)?;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        check_write(self, offset, bytes.len()).map_err(FlashError)?;
        Ok(self.at(offset as usize)?.write(bytes)?)
    }
}
