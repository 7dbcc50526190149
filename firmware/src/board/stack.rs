//! How much of the stack was ever used: it is painted at the start.
#![allow(unsafe_code, reason = "the stack has no owner")]

/// What is reserved for the stack, bytes.
pub const RESERVED: usize = 64 * 1024;

const PAINT: u32 = 0xC0DE_57AC;

unsafe extern "C" {
    static _stack_start: u32;
}

/// The lowest word that is reserved.
fn bottom() -> *mut u32 {
    let top = (&raw const _stack_start).cast::<u8>();
    top.wrapping_sub(RESERVED).cast_mut().cast()
}

/// Paints what is not in use.
#[inline(never)]
pub fn paint() {
    let here = cortex_m::register::msp::read() as usize;
    let mut word = bottom();
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
    let mut word = bottom();
    let mut untouched = 0;
    // SAFETY: the reserved stack is memory that may be read.
    while untouched < RESERVED && unsafe { word.read_volatile() } == PAINT {
        untouched += 4;
        word = word.wrapping_add(1);
    }
    RESERVED - untouched
}
