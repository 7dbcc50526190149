//! The board's watchdog (CMSDK APB watchdog, ARM DDI 0479, 4.6): it resets the board when it was not fed for two periods.
#![allow(unsafe_code, reason = "registers are at fixed addresses")]

use super::registers::write;

const BASE: usize = 0x4000_8000;
const LOAD: usize = 0x00;
const CONTROL: usize = 0x08;
const CLEAR: usize = 0x0C;
const LOCK: usize = 0xC00;
const KEY: u32 = 0x1ACC_E551;
/// Interrupt and reset.
const ENABLE: u32 = 0b11;

/// It counts at 25 MHz.
const TICKS_A_MICROSECOND: u32 = 25;

/// The watchdog.
pub struct Watchdog(());

impl Watchdog {
    /// Starts it: from now on it must be fed every `period` microseconds, at most 171 s.
    #[must_use]
    pub fn start(period: u32) -> Self {
        // SAFETY: these are registers of a watchdog that only this driver uses.
        unsafe {
            write(BASE, LOCK, KEY);
            write(BASE, LOAD, period.saturating_mul(TICKS_A_MICROSECOND));
            write(BASE, CONTROL, ENABLE);
        }
        Self(())
    }

    /// Feeds it.
    pub fn feed(&mut self) {
        // SAFETY: this is a register of a watchdog that only this driver uses.
        unsafe { write(BASE, CLEAR, 1) };
    }
}
