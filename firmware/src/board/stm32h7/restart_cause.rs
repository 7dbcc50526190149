//! Why the chip has started (RM0433, 8.7.39 "RCC_RSR").

use embassy_stm32::pac::RCC;

use crate::board::RestartCause;

/// Why this start, from flags that are cleared by this: call once.
#[must_use]
pub fn take() -> RestartCause {
    let flags = RCC.rsr().read();
    RCC.rsr().modify(|flags| flags.set_rmvf(true));
    if flags.porrstf() || flags.borrstf() {
        RestartCause::Power
    } else if flags.iwdg1rstf() {
        RestartCause::Watchdog
    } else if flags.sftrstf() {
        RestartCause::Software
    } else {
        RestartCause::Other
    }
}
