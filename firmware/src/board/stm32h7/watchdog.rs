//! The independent watchdog (RM0433, chapter 49), on an oscillator of its own of 32 kHz that is off by up to 8 per cent.

use embassy_stm32::pac::iwdg::vals::{Key, Pr};
use embassy_stm32::pac::{DBGMCU, IWDG1};

use crate::board::{WATCHDOG_PERIOD, Watchdog};

/// Nominal frequency of the oscillator, Hz.
const OSCILLATOR: u32 = 32_000;
const DIVISOR: u32 = 64;
const RELOAD: u32 = WATCHDOG_PERIOD / 1000 * (OSCILLATOR / 1000) / DIVISOR - 1;
const _: () = assert!(RELOAD < 1 << 12, "the counter has twelve bits");

/// The watchdog, which runs.
pub struct IndependentWatchdog(());

impl IndependentWatchdog {
    /// Starts it: from now on it must be fed. The first thing that the program does.
    #[must_use]
    pub fn unleash() -> Self {
        // It stands still while a debugger holds the processor (RM0433, chapter 60, "DBGMCU_APB4FZ1").
        DBGMCU.apb4fzr1().modify(|frozen| frozen.set_iwdg1(true));
        IWDG1.kr().write(|key| key.set_key(Key::START));
        IWDG1.kr().write(|key| key.set_key(Key::ENABLE));
        IWDG1.pr().write(|prescaler| prescaler.set_pr(Pr::DIVIDE_BY64));
        IWDG1.rlr().write(|reload| reload.set_rl(RELOAD as u16));
        // Both arrive after some periods of the oscillator; what starts the counter again before would start the old one.
        while IWDG1.sr().read().pvu() || IWDG1.sr().read().rvu() {}
        let mut watchdog = Self(());
        watchdog.feed();
        watchdog
    }
}

impl Watchdog for IndependentWatchdog {
    fn feed(&mut self) {
        IWDG1.kr().write(|key| key.set_key(Key::RESET));
    }
}
