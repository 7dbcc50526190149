//! Whose clock the board has: the debugger's of 8 MHz, or the chip's own oscillator where the debugger gives none.

use embassy_stm32::Config;
use embassy_stm32::pac::RCC;
use embassy_stm32::rcc::{AHBPrescaler, APBPrescaler, HSIPrescaler, Hse, HseMode, PllPreDiv, PllSource, Sysclk, mux};
use embassy_stm32::time::Hertz;

/// How often is looked whether the debugger's clock runs: some 20 ms at 64 MHz.
const PATIENCE: u32 = 100_000;
/// The debugger's clock is that of a crystal, and the chip's own oscillator is off by so much at most (DS12110 and DS13313,
/// "HSI oscillator characteristics"), each in millionths.
const CRYSTAL: u32 = 100;
const OWN_OSCILLATOR: u32 = 20_000;

/// Whose clock it is.
#[derive(Clone, Copy)]
pub struct Source {
    has_crystal: bool,
}

impl Source {
    /// Looks at the debugger's clock.
    #[must_use]
    pub fn find() -> Self {
        Self { has_crystal: has_crystal() }
    }

    /// Whether the clock is that of a crystal.
    #[must_use]
    pub const fn has_crystal(self) -> bool {
        self.has_crystal
    }

    /// Has the chip watch the debugger's clock from now on, if that drives it: when it stops, the chip goes on with its own oscillator and a
    /// non-maskable interrupt comes, which starts it again (RM0433, 8.5.3 "Clock security system (CSS)").
    pub fn watch(self) {
        if self.has_crystal {
            RCC.cr().modify(|control| control.set_hsecsson(true));
        }
    }

    /// By how much the clock may be off, millionths.
    #[must_use]
    pub const fn tolerance(self) -> u32 {
        if self.has_crystal { CRYSTAL } else { OWN_OSCILLATOR }
    }
}

/// Whether the debugger's clock runs: the library would wait for it for ever.
fn has_crystal() -> bool {
    RCC.cr().modify(|control| control.set_hsebyp(true));
    RCC.cr().modify(|control| control.set_hseon(true));
    let is_running = (0..PATIENCE).any(|_| RCC.cr().read().hserdy());
    if !is_running {
        RCC.cr().modify(|control| control.set_hseon(false));
    }
    is_running
}

/// What the clock trees of all chips share: 8 MHz into PLL 1, with the source and divisor that are returned; the processor's
/// clock from its output P, half of it for the memories, a quarter for the peripherals, and FDCAN's from its output Q.
pub fn common(has_crystal: bool) -> (Config, PllSource, PllPreDiv) {
    let mut config = Config::default();
    let rcc = &mut config.rcc;
    rcc.hse = has_crystal.then_some(Hse { freq: Hertz(8_000_000), mode: HseMode::Bypass });
    rcc.hsi = (!has_crystal).then_some(HSIPrescaler::DIV1);
    rcc.csi = false;
    rcc.sys = Sysclk::PLL1_P;
    rcc.d1c_pre = AHBPrescaler::DIV1;
    rcc.ahb_pre = AHBPrescaler::DIV2;
    rcc.apb1_pre = APBPrescaler::DIV2;
    rcc.apb2_pre = APBPrescaler::DIV2;
    rcc.apb3_pre = APBPrescaler::DIV2;
    rcc.apb4_pre = APBPrescaler::DIV2;
    rcc.mux.fdcansel = mux::Fdcansel::PLL1_Q;
    if has_crystal { (config, PllSource::HSE, PllPreDiv::DIV1) } else { (config, PllSource::HSI, PllPreDiv::DIV8) }
}
