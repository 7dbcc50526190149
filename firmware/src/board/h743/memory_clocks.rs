//! The clocks of memories that are off after a reset (RM0433, 8.7.42 "RCC_AHB2ENR").

use embassy_stm32::pac::RCC;

/// Switches on the RAM of the Ethernet. Without it the first store there is a bus fault.
pub fn enable() {
    RCC.ahb2enr().modify(|enabled| enabled.set_sram1en(true));
    // The clock runs two cycles after the store (RM0433, 8.5.10): this waits for longer.
    let _ = RCC.ahb2enr().read();
    cortex_m::asm::dsb();
}
