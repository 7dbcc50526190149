//! How much of the stack was ever used: it is painted at the start.
#![allow(unsafe_code, reason = "the stack has no owner")]

pub use super::current::{STACK_GUARD as GUARD, STACK_TOP as TOP};

/// What is reserved for the stack, bytes: the tightly coupled data memory of the STM32H743.
pub const RESERVED: usize = 128 * 1024;

const PAINT: u32 = 0xC0DE_57AC;

/// The lowest word that is reserved. From there on [`GUARD`] bytes are out of reach.
pub fn bottom() -> *mut u32 {
    (TOP as usize - RESERVED) as *mut u32
}

/// The lowest word that may be used.
fn lowest() -> *mut u32 {
    bottom().wrapping_byte_add(GUARD)
}

/// Whether so many bytes from an address on are memory of the stack that may be used.
#[must_use]
pub fn holds(address: usize, length: usize) -> bool {
    address >= lowest() as usize && address.saturating_add(length) <= TOP as usize
}

/// Paints what is not in use.
#[inline(never)]
pub fn paint() {
    let here = cortex_m::register::msp::read() as usize;
    let mut word = lowest();
    // Below this function's own frame, with room to spare.
    while (word as usize) < here - 256 {
        // SAFETY: the stack's memory below the stack pointer belongs to nobody.
        unsafe {
            word.write_volatile(PAINT);
            word = word.add(1);
        }
    }
}

/// Bytes that were used at most since then.
#[must_use]
pub fn deepest() -> usize {
    let mut word = lowest();
    let mut untouched = GUARD;
    // SAFETY: the reserved stack is memory that may be read.
    while untouched < RESERVED && unsafe { word.read_volatile() } == PAINT {
        untouched += 4;
        word = word.wrapping_add(1);
    }
    RESERVED - untouched
}
