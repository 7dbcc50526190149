//! Clocks: 480 MHz from the debugger's clock of 8 MHz, 400 MHz where the silicon allows no more, and the chip's own
//! oscillator where the debugger gives none.
#![allow(unsafe_code, reason = "a register of the buses has no name in the library")]

use embassy_stm32::Config;
use embassy_stm32::pac::{DBGMCU, RCC};
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, HSIPrescaler, Hse, HseMode, Pll, PllDiv, PllMul, PllPreDiv, PllSource, Sysclk,
    VoltageScale, mux,
};
use embassy_stm32::time::Hertz;

/// Revisions of the silicon from X on may run at 480 MHz; those before, Y among them, at 400 MHz (DS12110, "General operating
/// conditions"; RM0433, 60.5.8 "DBGMCU_IDC").
const FIRST_FAST_REVISION: u16 = 0x2001;
/// How often is looked whether the debugger's clock runs: some 20 ms at 64 MHz.
const PATIENCE: u32 = 100_000;
/// The debugger's clock is that of a crystal, and the chip's own oscillator is off by so much at most (DS12110, "HSI
/// oscillator characteristics"), each in millionths.
const CRYSTAL: u32 = 100;
const OWN_OSCILLATOR: u32 = 20_000;
/// `READ_ISS_OVERRIDE` of the bus's target 7, the AXI SRAM: the workaround of what reads may corrupt there in the older
/// silicon (ES0392, 2.2.9; RM0433, 2.2.4 "AXI_TARGx_FN_MOD").
const TARGET_7_FUNCTIONS: *mut u32 = 0x5100_8108 as *mut u32;

/// What the clocks are made of.
#[derive(Clone, Copy)]
pub struct Source {
    has_crystal: bool,
    is_fast: bool,
}

impl Source {
    /// Looks at the silicon and at the debugger's clock.
    #[must_use]
    pub fn find() -> Self {
        let is_fast = DBGMCU.idc().read().rev_id() >= FIRST_FAST_REVISION;
        if !is_fast {
            // SAFETY: this register is there in this family of chips, and only this function knows it.
            unsafe { TARGET_7_FUNCTIONS.write_volatile(1) };
        }
        Self { has_crystal: has_crystal(), is_fast }
    }

    /// Whether the clock is that of a crystal.
    #[must_use]
    pub const fn has_crystal(self) -> bool {
        self.has_crystal
    }

    /// By how much the clock may be off, millionths.
    #[must_use]
    pub const fn tolerance(self) -> u32 {
        if self.has_crystal { CRYSTAL } else { OWN_OSCILLATOR }
    }

    /// The clock tree: 80 MHz for FDCAN, half of the processor's clock for the buses.
    #[must_use]
    pub fn config(self) -> Config {
        let mut config = Config::default();
        let rcc = &mut config.rcc;
        rcc.hse = self.has_crystal.then_some(Hse { freq: Hertz(8_000_000), mode: HseMode::Bypass });
        rcc.hsi = (!self.has_crystal).then_some(HSIPrescaler::DIV1);
        rcc.csi = false;
        rcc.pll1 = Some(Pll {
            source: if self.has_crystal { PllSource::HSE } else { PllSource::HSI },
            prediv: if self.has_crystal { PllPreDiv::DIV1 } else { PllPreDiv::DIV8 },
            mul: if self.is_fast { PllMul::MUL120 } else { PllMul::MUL100 },
            fracn: None,
            divp: Some(PllDiv::DIV2),
            divq: Some(if self.is_fast { PllDiv::DIV12 } else { PllDiv::DIV10 }),
            divr: None,
        });
        rcc.sys = Sysclk::PLL1_P;
        rcc.d1c_pre = AHBPrescaler::DIV1;
        rcc.ahb_pre = AHBPrescaler::DIV2;
        rcc.apb1_pre = APBPrescaler::DIV2;
        rcc.apb2_pre = APBPrescaler::DIV2;
        rcc.apb3_pre = APBPrescaler::DIV2;
        rcc.apb4_pre = APBPrescaler::DIV2;
        rcc.voltage_scale = if self.is_fast { VoltageScale::Scale0 } else { VoltageScale::Scale1 };
        rcc.mux.fdcansel = mux::Fdcansel::PLL1_Q;
        config
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
