//! Clocks of parts that nobody uses (RM0433, 8.7.40 to 8.7.47), in every chip of the family.

use embassy_stm32::pac::RCC;

/// Switches off what the released library switches on for whoever may come.
pub fn disable() {
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
