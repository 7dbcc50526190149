//! How much of the stack was ever used: it is painted at the start.
#![allow(unsafe_code, reason = "the stack has no owner, and its place is known to the linker")]

unsafe extern "C" {
    static _stack_start: u8;
    static _stack_end: u8;
    static _stack_guard: u8;
}

const PAINT: u32 = 0xC0DE_57AC;

/// Where the stack begins: behind its highest word.
fn top() -> usize {
    (&raw const _stack_start) as usize
}

/// The lowest address that is reserved. From there on [`guard`] bytes are out of reach.
#[must_use]
pub fn bottom() -> usize {
    (&raw const _stack_end) as usize
}

/// Bytes at the end of the stack that nobody may touch.
#[must_use]
pub fn guard() -> usize {
    (&raw const _stack_guard) as usize
}

/// What is reserved for the stack, bytes.
#[must_use]
pub fn reserved() -> usize {
    top() - bottom()
}

/// The lowest word that may be used.
fn lowest() -> *mut u32 {
    (bottom() + guard()) as *mut u32
}

/// Whether so many bytes from an address on are memory of the stack that may be used.
#[must_use]
pub fn holds(address: usize, length: usize) -> bool {
    address >= lowest() as usize && address.saturating_add(length) <= top()
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
    // SAFETY: the reserved stack is memory that may be read.
    while (word as usize) < top() && unsafe { word.read_volatile() } == PAINT {
        word = word.wrapping_add(1);
    }
    top() - word as usize
}
