//! Faults restart the board, and are told of after the restart.
#![allow(unsafe_code, reason = "handlers of exceptions have no safe interface, and the stack may be what has failed")]

use core::arch::naked_asm;

use cortex_m_rt::exception;

use crate::board::{restart, retained, stack};

/// CFSR, HFSR, MMFAR and BFAR of the processor: what a fault is, and where (ARMv7-M ARM, B3.2.15 to B3.2.18).
const CFSR: *const u32 = 0xE000_ED28 as *const u32;
const HFSR: *const u32 = 0xE000_ED2C as *const u32;
const MMFAR: *const u32 = 0xE000_ED34 as *const u32;
const BFAR: *const u32 = 0xE000_ED38 as *const u32;
/// MMFAR and BFAR hold an address.
const MMARVALID: u32 = 1 << 7;
const BFARVALID: u32 = 1 << 15;
/// Places of LR and PC in the frame of an exception (ARMv7-M ARM, B1.5.6).
const LINK: usize = 5;
const PROGRAM_COUNTER: usize = 6;

/// A fault, with the stack as it is: if it has come to its end, its memory is used again from its beginning, as nothing
/// returns from here. Below `_stack_lowest_of_faults` there is no room to tell of it.
#[unsafe(no_mangle)]
#[unsafe(naked)]
unsafe extern "C" fn HardFault() -> ! {
    naked_asm!(
        "mrs r0, msp",
        "movw r1, #:lower16:_stack_lowest_of_faults",
        "movt r1, #:upper16:_stack_lowest_of_faults",
        "cmp r0, r1",
        "bhs 1f",
        "movw r1, #:lower16:_stack_start",
        "movt r1, #:upper16:_stack_start",
        "msr msp, r1",
        "isb",
        "1:",
        "b {tell}",
        tell = sym tell,
    )
}

/// Keeps what is known of a fault whose frame is there, and restarts.
unsafe extern "C" fn tell(frame: *const u32) -> ! {
    // SAFETY: these registers may be read at any time. The frame is read if it is on the stack.
    let (cause, hard, memory, bus) =
        unsafe { (CFSR.read_volatile(), HFSR.read_volatile(), MMFAR.read_volatile(), BFAR.read_volatile()) };
    let address = match cause {
        _ if cause & MMARVALID != 0 => memory,
        _ if cause & BFARVALID != 0 => bus,
        _ => 0,
    };
    let is_there = stack::holds(frame as usize, 32);
    let read = |place: usize| {
        if is_there {
            // SAFETY: the frame's eight words are within the stack.
            unsafe { frame.add(place).read_volatile() }
        } else {
            0
        }
    };
    let (counter, link) = (read(PROGRAM_COUNTER), read(LINK));
    retained::keep(&format_args!(
        "fault: CFSR {cause:#010x}, HFSR {hard:#010x}, address {address:#010x}, PC {counter:#010x}, LR {link:#010x}"
    ));
    restart()
}

/// The debugger's clock has stopped, and with it every clock that was made of it: what runs here has the chip's own oscillator, which is too
/// far off for the bus. After the restart that is known from the beginning.
#[exception]
unsafe fn NonMaskableInt() -> ! {
    retained::keep(&"the debugger's clock has stopped");
    restart()
}

/// An exception that nothing was to raise.
#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    retained::keep(&format_args!("an interrupt that nobody handles: {number}"));
    restart()
}
