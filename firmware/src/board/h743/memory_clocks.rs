//! Clocks of memories that are off after a reset, and of parts that nobody uses (RM0433, 8.7.40 to 8.7.47).

use embassy_stm32::pac::RCC;

/// Switches on the RAM of the Ethernet. Without it the first store there is a bus fault.
pub fn enable() {
    RCC.ahb2enr().modify(|enabled| enabled.set_sram1en(true));
    // The clock runs two cycles after the store (RM0433, 8.5.10): this waits for longer.
    let _ = RCC.ahb2enr().read();
    cortex_m::asm::dsb();
}

/// Switches off what the released library switches on for whoever may come.
pub fn disable_unused() {
    RCC.ahb1enr().modify(|enabled| {
        enabled.set_dma1en(false);
        enabled.set_dma2en(false);
    });
    RCC.ahb3enr().modify(|enabled| enabled.set_mdmaen(false));
    RCC.ahb4enr().modify(|enabled| {
        enabled.set_bdmaen(false);
        enabled.set_gpioeen(false);
        enabled.set_gpiofen(false);
        enabled.set_gpiohen(false);
        enabled.set_gpioien(false);
        enabled.set_gpiojen(false);
        enabled.set_gpioken(false);
    });
}
