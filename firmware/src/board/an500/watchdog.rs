//! The board's watchdog (CMSDK APB watchdog, ARM DDI 0479, 4.6): it resets the board when it was not fed for two periods.
#![allow(unsafe_code, reason = "registers are at fixed addresses")]

use super::registers::write;
use crate::board::{WATCHDOG_PERIOD, Watchdog};

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
pub struct ApbWatchdog(());

impl ApbWatchdog {
    /// The watchdog, not started. Call once.
    #[must_use]
    pub const fn new() -> Self {
        Self(())
    }

    /// Starts it: from now on it must be fed.
    pub fn unleash(&mut self) {
        // SAFETY: these are registers of a watchdog that only this driver uses.
        unsafe {
            write(BASE, LOCK, KEY);
            write(BASE, LOAD, WATCHDOG_PERIOD * TICKS_A_MICROSECOND);
            write(BASE, CONTROL, ENABLE);
        }
    }
}

impl Watchdog for ApbWatchdog {
    fn feed(&mut self) {
        // SAFETY: this is a register of a watchdog that only this driver uses.
        unsafe { write(BASE, CLEAR, 1) };
    }
}

impl Default for ApbWatchdog {
    fn default() -> Self {
        Self::new()
    }
}
