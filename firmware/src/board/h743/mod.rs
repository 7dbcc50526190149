//! The vehicle's board: a Nucleo-H743ZI with an STM32H743ZI (UM1974, UM2407, RM0433).
//!
//! 2 MB of flash in two banks, of which the second one keeps settings and maps: the program goes on while it is written. 480 MHz,
//! or 400 MHz where the silicon allows no more.
#![allow(unsafe_code, reason = "a register of the buses has no name in the library")]

use agv_core::localizer::LentCapacities;
use embassy_stm32::Config;
use embassy_stm32::pac::{DBGMCU, RCC};
use embassy_stm32::rcc::{Pll, PllDiv, PllMul, VoltageScale};

use super::stm32h7::{self, Bank, Chip, Region};

/// The board.
pub type Nucleo = stm32h7::Nucleo<Stm32h743>;

/// The chip.
pub struct Stm32h743;

/// Revisions of the silicon from X on may run at 480 MHz; those before, Y among them, at 400 MHz (DS12110, "General operating
/// conditions"; RM0433, 60.5.8 "DBGMCU_IDC").
const FIRST_FAST_REVISION: u16 = 0x2001;
/// `READ_ISS_OVERRIDE` of the bus's target 7, the AXI SRAM: the workaround of what reads may corrupt there in the older
/// silicon (ES0392, 2.2.9; RM0433, 2.2.4 "AXI_TARGx_FN_MOD").
const TARGET_7_FUNCTIONS: *mut u32 = 0x5100_8108 as *mut u32;

fn is_fast() -> bool {
    DBGMCU.idc().read().rev_id() >= FIRST_FAST_REVISION
}

impl Chip for Stm32h743 {
    const NAME: &'static str = "Nucleo-H743ZI";
    const SETTINGS: Bank = Bank::Second;
    const NOT_CACHED: &'static [Region] = &[
        // The beginning of SRAM1 of domain D2, where the Ethernet's DMA reads and writes.
        Region { base: 0x3000_0000, size: 32 * 1024 },
        // SRAM4 of domain D3: what is kept over a reset, which throws lines of the cache away.
        Region { base: 0x3800_0000, size: 64 * 1024 },
    ];

    type Capacities = LentCapacities<'static>;

    fn enable_memories() {
        RCC.ahb2enr().modify(|enabled| {
            enabled.set_sram1en(true);
            enabled.set_sram2en(true);
        });
        // The clocks run two cycles after the store (RM0433, 8.5.10): this waits for longer.
        let _ = RCC.ahb2enr().read();
        cortex_m::asm::dsb();
    }

    fn mend() {
        if !is_fast() {
            // SAFETY: this register is there in this chip, and only this function knows it.
            unsafe { TARGET_7_FUNCTIONS.write_volatile(1) };
        }
    }

    fn clock_tree(has_crystal: bool) -> Config {
        let (mut config, source, prediv) = stm32h7::common_clocks(has_crystal);
        let is_fast = is_fast();
        config.rcc.pll1 = Some(Pll {
            source,
            prediv,
            mul: if is_fast { PllMul::MUL120 } else { PllMul::MUL100 },
            fracn: None,
            divp: Some(PllDiv::DIV2),
            divq: Some(if is_fast { PllDiv::DIV12 } else { PllDiv::DIV10 }),
            divr: None,
        });
        config.rcc.voltage_scale = if is_fast { VoltageScale::Scale0 } else { VoltageScale::Scale1 };
        config
    }
}
