//! The flash of what is kept: two pages for the settings and, where the chip has them, two for the map of contours before them, at the end of
//! a bank (RM0433, chapter 4). A program in another bank goes on while this one is written or erased; one in the same bank stands still, as
//! whoever reads a bank that works waits.
//!
//! A loss of power while a word is programmed or a page erased leaves words with a double error, and reading one is a bus
//! fault. So words are read while such faults are ignored, and a word with a double error reads as zeros, which no checksum
//! of an item takes. A page of which most is so is one whose erasure was cut short: it is erased again at the start.
#![allow(unsafe_code, reason = "flash is memory at addresses that the linker says, and its faults are the processor's")]

use core::arch::asm;
use core::marker::PhantomData;
use core::ops::Range;
use core::slice;

use agv_settings::block_on;
use agv_settings::patient_flash::PatientFlash;
use embassy_stm32::Peri;
use embassy_stm32::pac::FLASH as REGISTERS;
use embassy_stm32::pac::flash::Bank as BankRegisters;
use embassy_stm32::peripherals::FLASH;
use embassy_time::{Duration, Instant, Timer};
use embedded_storage::nor_flash::{ErrorType, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_read};

use super::Chip;

unsafe extern "C" {
    static _settings_start: u8;
    static _settings_length: u8;
    static _contours_start: u8;
    static _contours_length: u8;
}

/// Where the first bank begins, bytes.
const FLASH_START: usize = 0x0800_0000;
/// Bytes of a bank in the memory map.
const BANK: usize = 0x10_0000;
/// A bank of flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bank {
    /// The one that the program is in.
    First,
    /// The other one.
    Second,
}

impl Bank {
    /// Whether the program is there.
    pub const fn has_program(self) -> bool {
        matches!(self, Self::First)
    }

    fn registers(self) -> BankRegisters {
        REGISTERS.bank(self as usize)
    }

    const fn start(self) -> usize {
        FLASH_START + self as usize * BANK
    }
}

/// Bytes of a page.
const PAGE: usize = 128 * 1024;
/// Bytes of a word, which is programmed at once and once only.
const WORD: usize = 32;
/// 64 bits at once: the shortest times, at 1.8 V or more.
const PARALLELISM: u8 = 3;
/// How often is looked whether a word is programmed or a page erased, which take some 0.2 ms and 1 to 2 s (DS12110, "Flash memory
/// programming"): whoever runs below has the processor meanwhile.
const LOOK: Duration = Duration::from_micros(250);
/// Reading for so long keeps whoever runs below waiting; then they have so much time.
const WORK: Duration = Duration::from_millis(1);
const REST: Duration = Duration::from_micros(250);
/// What unlocks the control register (RM0433, 4.5.2).
const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
/// CFSR of the processor, whose flags are cleared by ones.
const CFSR: *mut u32 = 0xE000_ED28 as *mut u32;
const BUS_FAULTS: u32 = 0xFF00;

/// It was not done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlashError {
    /// The flash reports an error, or holds something else than what was written.
    Refused,
    /// Outside of the pages, or not in whole words.
    Place(NorFlashErrorKind),
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Refused => NorFlashErrorKind::Other,
            Self::Place(kind) => *kind,
        }
    }
}

type FlashWord = [u32; WORD / 4];

/// Pages that nobody else writes.
pub struct Pages<C> {
    /// Their addresses.
    at: Range<usize>,
    /// When others have had the processor the last time.
    rested: Instant,
    chip: PhantomData<C>,
}

/// The pages of the chip's flash, of the settings and of the map of contours, if it has some; those whose erasure was cut short are
/// erased.
#[must_use]
pub fn open<C: Chip>(_: Peri<'static, FLASH>) -> (Pages<C>, Option<Pages<C>>) {
    let contours = contours();
    (Pages::open(settings()), (!contours.is_empty()).then(|| Pages::open(contours)))
}

impl<C: Chip> Pages<C> {
    fn open(at: Range<usize>) -> Self {
        let mut pages = Self { at, rested: Instant::MIN, chip: PhantomData };
        for page in 0..pages.capacity() / PAGE {
            let (mut torn, mut written) = (0_usize, 0_usize);
            for offset in (page * PAGE..(page + 1) * PAGE).step_by(WORD) {
                match read_word(C::SETTINGS, pages.address(offset)) {
                    None => torn += 1,
                    Some(word) => written += usize::from(word != [u32::MAX; WORD / 4]),
                }
            }
            if torn > written {
                let _ = block_on(pages.erase((page * PAGE) as u32, ((page + 1) * PAGE) as u32));
            }
        }
        pages
    }

    /// Whether these are whole words, or pages, of this flash.
    const fn check(&self, from: u32, to: usize, whole: usize) -> Result<(), FlashError> {
        let from = from as usize;
        if from > to || to > self.at.end - self.at.start {
            Err(FlashError::Place(NorFlashErrorKind::OutOfBounds))
        } else if !from.is_multiple_of(whole) || !to.is_multiple_of(whole) {
            Err(FlashError::Place(NorFlashErrorKind::NotAligned))
        } else {
            Ok(())
        }
    }

    /// The address of an offset in the pages.
    const fn address(&self, offset: usize) -> usize {
        self.at.start + offset
    }
}

/// Bytes of the pages of contours, from an offset on, which the processor reads where they are. None beyond the pages.
///
/// Nobody may write them as long as they are used; one with a double error is a fault, so they are to be read through [`Pages`] before.
#[must_use]
pub fn contour_bytes(offset: usize, length: usize) -> Option<&'static [u8]> {
    let at = contours();
    let end = offset.checked_add(length).filter(|end| *end <= at.len())?;
    // SAFETY: these are addresses of the pages, which are flash as long as the program runs; whoever keeps maps there writes the other copy.
    Some(unsafe { slice::from_raw_parts((at.start + offset) as *const u8, end - offset) })
}

/// Where the pages of the settings are.
pub fn settings() -> Range<usize> {
    addresses(&raw const _settings_start, &raw const _settings_length)
}

/// Where the pages of the map of contours are; nowhere on a chip that has none.
pub fn contours() -> Range<usize> {
    addresses(&raw const _contours_start, &raw const _contours_length)
}

/// Addresses by the symbols of the linker.
fn addresses(start: *const u8, length: *const u8) -> Range<usize> {
    let first = FLASH_START + start as usize;
    first..first + length as usize
}

/// Reads the word at an address in the pages. None if it has a double error.
fn read_word(bank: Bank, address: usize) -> Option<FlashWord> {
    let place = address as *const u32;
    let mut word = [0; WORD / 4];
    // SAFETY: the address is a whole word within the pages. Nothing else runs while faults are masked, which lasts for
    // eight loads; `memory_protection` has set that bus faults are ignored then. One that is leaves a mark, which is cleared.
    let has_error = unsafe {
        asm!("cpsid f", options(nostack));
        for (part, number) in word.iter_mut().zip(0..) {
            *part = place.add(number).read_volatile();
        }
        asm!("dsb", "isb", options(nostack));
        let has_error = bank.registers().sr().read().dbeccerr();
        if has_error {
            clear_errors(bank);
            CFSR.write_volatile(BUS_FAULTS);
        }
        asm!("cpsie f", options(nostack));
        has_error
    };
    (!has_error).then_some(word)
}

/// Errors stay until they are cleared, in a register of their own, and keep everything else from being done.
fn clear_errors(bank: Bank) {
    // Every flag that the status has.
    bank.registers().ccr().write(|flags| flags.0 = 0x1FEF_0000);
}

/// Does something with the bank unlocked, and lets others go on until it is done.
async fn unlocked(which: Bank, work: impl FnOnce(BankRegisters)) -> Result<(), FlashError> {
    let bank = which.registers();
    if bank.cr().read().lock() {
        for key in KEYS {
            bank.keyr().write_value(key);
        }
    }
    clear_errors(which);
    work(bank);
    cortex_m::asm::dsb();
    while bank.sr().read().bsy() || bank.sr().read().qw() {
        Timer::after(LOOK).await;
    }
    let status = bank.sr().read();
    let has_failed =
        status.wrperr() || status.pgserr() || status.strberr() || status.incerr() || status.operr() || status.wbne();
    clear_errors(which);
    bank.cr().write(|control| {
        control.set_psize(PARALLELISM);
        control.set_lock(true);
    });
    if has_failed { Err(FlashError::Refused) } else { Ok(()) }
}

impl<C: Chip> ErrorType for Pages<C> {
    type Error = FlashError;
}

impl<C: Chip> ReadNorFlash for Pages<C> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        check_read(self, offset, bytes.len()).map_err(FlashError::Place)?;
        let mut offset = offset as usize;
        let mut rest = bytes;
        while !rest.is_empty() {
            let skipped = offset % WORD;
            let word = read_word(C::SETTINGS, self.address(offset - skipped)).unwrap_or_default();
            let count = rest.len().min(WORD - skipped);
            let (now, later) = rest.split_at_mut(count);
            let read = word.iter().flat_map(|part| part.to_le_bytes()).skip(skipped);
            now.iter_mut().zip(read).for_each(|(byte, read)| *byte = read);
            rest = later;
            offset += count;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.at.len()
    }
}

impl<C: Chip> PatientFlash for Pages<C> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        self.check(from, to as usize, PAGE)?;
        for offset in (from as usize..to as usize).step_by(PAGE) {
            let page = (self.address(offset) - C::SETTINGS.start()) / PAGE;
            unlocked(C::SETTINGS, |bank| {
                bank.cr().write(|control| {
                    control.set_psize(PARALLELISM);
                    control.set_ser(true);
                    control.set_snb(page as u8);
                });
                bank.cr().modify(|control| control.set_start(true));
            })
            .await?;
        }
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        self.check(offset, offset as usize + bytes.len(), WORD)?;
        for (offset, bytes) in (offset as usize..).step_by(WORD).zip(bytes.chunks_exact(WORD)) {
            let mut word: FlashWord = [0; WORD / 4];
            for (part, bytes) in word.iter_mut().zip(bytes.as_chunks().0) {
                *part = u32::from_le_bytes(*bytes);
            }
            let address = self.address(offset);
            unlocked(C::SETTINGS, |bank| {
                bank.cr().write(|control| {
                    control.set_psize(PARALLELISM);
                    control.set_pg(true);
                });
                cortex_m::asm::dsb();
                for (part, number) in word.iter().zip(0..) {
                    // SAFETY: the address is within a whole word of the pages, which are flash, unlocked to be programmed.
                    unsafe { (address as *mut u32).add(number).write_volatile(*part) };
                }
            })
            .await?;
            if read_word(C::SETTINGS, address) != Some(word) {
                return Err(FlashError::Refused);
            }
        }
        Ok(())
    }

    async fn rest(&mut self) {
        if self.rested.elapsed() >= WORK {
            Timer::after(REST).await;
            self.rested = Instant::now();
        }
    }
}
