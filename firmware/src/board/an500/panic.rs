//! A panic in emulation ends it with the message.

use core::panic::PanicInfo;

use cortex_m_semihosting::{debug, hprintln};

/// Says what happened to the machine that emulates the board, and ends the emulation as failed.
pub fn report(info: &PanicInfo) -> ! {
    hprintln!("{}", info);
    debug::exit(debug::EXIT_FAILURE);
    loop {
        cortex_m::asm::wfi();
    }
}
