//! The control loop and nothing else, which links only if no panic can be reached from it.
//!
//! The panic handler calls a function that is defined nowhere. Where no panic is left in the program, the linker leaves the
//! handler out and misses nothing; where one is, it refuses.
#![no_std]
#![no_main]

mod control_loop;

use core::panic::PanicInfo;

use control_loop::ControlLoop;

#[allow(unsafe_code, reason = "a function of elsewhere can be declared in no other way")]
// SAFETY: there is no such function, so it is never called.
unsafe extern "C" {
    /// No such function exists.
    safe fn control_loop_can_panic() -> !;
}

#[panic_handler]
fn on_panic(_: &PanicInfo) -> ! {
    control_loop_can_panic()
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut control_loop = ControlLoop::take();
    loop {
        if let Some(control_loop) = &mut control_loop {
            control_loop.step();
        }
    }
}
