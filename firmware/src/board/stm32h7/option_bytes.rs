//! Option bytes that the vehicle rests on (RM0433 and RM0468, "FLASH option status register", `FLASH_OPTSR_CUR`).

use embassy_stm32::pac::FLASH;

/// At level 0, that of the factory, nothing resets the processor while the supply falls, down to the threshold of the power-down reset: it may
/// write to its flash then. Levels 1 to 3 reset it before.
const LEAST_BROWN_OUT: u8 = 1;

/// Whether the brown-out reset is on, and the banks of flash are not exchanged: the image and its settings are where they were linked.
#[must_use]
pub fn are_right() -> bool {
    let options = FLASH.optsr_cur().read();
    let (brown_out, is_swapped) = (options.bor_lev(), options.swap_bank_opt());
    if brown_out < LEAST_BROWN_OUT {
        defmt::warn!("option bytes: the brown-out reset is off (BOR_LEV)");
    }
    if is_swapped {
        defmt::warn!("option bytes: the banks of flash are exchanged (SWAP_BANK_OPT)");
    }
    brown_out >= LEAST_BROWN_OUT && !is_swapped
}
