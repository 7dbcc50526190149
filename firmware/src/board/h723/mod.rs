//! A smaller board: a Nucleo-H723ZG with an STM32H723ZG (UM2407, RM0468).
//!
//! 1 MB of flash in a single bank, which keeps program and settings: the processor stands still while it is written. 320 KiB
//! of AXI SRAM, as the option bytes have it at the factory (RM0468, 2.4: `TCM_AXI_SHARED` is 0), so the map in the state is
//! left out, and fixed maps are smaller. 480 MHz, which all of this silicon allows with error correction in all memories.

use agv_core::filter::{PoseAndSlots, packed_entries, slot_states};
use agv_core::localizer::CapacitiesOf;
use agv_core::sources::{Lent, NoContours};
use embassy_stm32::Config;
use embassy_stm32::pac::RCC;
use embassy_stm32::rcc::{Pll, PllDiv, PllMul, SupplyConfig, VoltageScale};

use super::stm32h7::{self, Bank, Chip, Region};

/// The board.
pub type Nucleo = stm32h7::Nucleo<Stm32h723>;

/// The chip.
pub struct Stm32h723;

/// The state of a filter with biases only.
type NoSlots = PoseAndSlots<0, 0, { slot_states(0, 0) }, { packed_entries(slot_states(0, 0)) }>;

impl Chip for Stm32h723 {
    const NAME: &'static str = "Nucleo-H723ZG";
    const SETTINGS: Bank = Bank::First;
    const NOT_CACHED: &'static [Region] = &[
        // SRAM1 of domain D2, where the Ethernet's DMA reads and writes.
        Region { base: 0x3000_0000, size: 16 * 1024 },
        // SRAM4 of domain D3: what is kept over a reset, which throws lines of the cache away.
        Region { base: 0x3800_0000, size: 16 * 1024 },
    ];

    type Capacities = CapacitiesOf<1440, 500, 500, 128, NoSlots, NoContours, Lent<'static>>;

    fn enable_memories() {
        RCC.ahb2enr().modify(|enabled| enabled.set_sram1en(true));
        // The clock runs two cycles after the store (RM0468, 8.5.10): this waits for longer.
        let _ = RCC.ahb2enr().read();
        cortex_m::asm::dsb();
    }

    fn clock_tree(has_crystal: bool) -> Config {
        let (mut config, source, prediv) = stm32h7::common_clocks(has_crystal);
        // The oscillator of the PLL goes up to 836 MHz, and its output P may be undivided (RM0468, 8.7.14 "RCC_PLL1DIVR").
        config.rcc.pll1 = Some(Pll {
            source,
            prediv,
            mul: PllMul::MUL60,
            divp: Some(PllDiv::DIV1),
            divq: Some(PllDiv::DIV6),
            divr: None,
        });
        config.rcc.voltage_scale = VoltageScale::Scale0;
        // This line of the family has no step-down converter (RM0468, 6.4.1).
        config.rcc.supply_config = SupplyConfig::LDO;
        config
    }
}
