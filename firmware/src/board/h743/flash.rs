//! The settings' flash: the last two pages of the second bank. The program is in the first one, and goes on while this one
//! is written or erased.
#![allow(unsafe_code, reason = "the linker says where the pages are")]

use embassy_stm32::Peri;
use embassy_stm32::flash::{Blocking, Error, Flash, MAX_ERASE_SIZE, WRITE_SIZE};
use embassy_stm32::peripherals::FLASH;
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};

unsafe extern "C" {
    static _settings_start: u8;
    static _settings_length: u8;
}

/// Offset of the first page in flash.
fn start() -> u32 {
    (&raw const _settings_start) as u32
}

/// The pages.
pub struct SettingsFlash(Flash<'static, Blocking>);

impl SettingsFlash {
    /// The pages of the chip's flash.
    #[must_use]
    pub fn new(flash: Peri<'static, FLASH>) -> Self {
        Self(Flash::new_blocking(flash))
    }
}

impl ErrorType for SettingsFlash {
    type Error = Error;
}

impl ReadNorFlash for SettingsFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        self.0.blocking_read(start() + offset, bytes)
    }

    fn capacity(&self) -> usize {
        (&raw const _settings_length) as usize
    }
}

impl NorFlash for SettingsFlash {
    const WRITE_SIZE: usize = WRITE_SIZE;
    const ERASE_SIZE: usize = MAX_ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        self.0.blocking_erase(start() + from, start() + to)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        self.0.blocking_write(start() + offset, bytes)
    }
}
