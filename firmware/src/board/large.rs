//! Memory for large values beside that of all other statics, which would not hold them.
//!
//! It is no `.bss`, as its clock may be off when that is cleared: a board clears it when it starts.
#![allow(unsafe_code, reason = "the memory is known to the linker")]

unsafe extern "C" {
    static mut _large_start: u32;
    static mut _large_end: u32;
}

/// Makes zeros of all of it.
///
/// # Safety
/// To be called once, before anybody uses what is there. All zero must be a valid beginning of every static there, as it is
/// of a `StaticCell`.
pub unsafe fn clear() {
    let (mut word, end) = (&raw mut _large_start, &raw mut _large_end);
    while word < end {
        // SAFETY: the linker has put both on whole words, and nobody uses what is between them yet.
        unsafe {
            word.write_volatile(0);
            word = word.add(1);
        }
    }
}
