//! The image `no_panic` with one panic in it: what shows that a panic would be found there.
#![no_std]
#![no_main]

#[path = "no_panic/control_loop/mod.rs"]
mod control_loop;

use core::hint::black_box;
use core::panic::PanicInfo;

use control_loop::ControlLoop;

#[allow(unsafe_code, reason = "a function of elsewhere can be declared in no other way")]
// SAFETY: there is no such function; this image is built to be looked at, and never runs.
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
    let places = black_box([0_u8; 4]);
    loop {
        if let Some(control_loop) = &mut control_loop {
            control_loop.step();
        }
        black_box(places[black_box(4)]);
    }
}
