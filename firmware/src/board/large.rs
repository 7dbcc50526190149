//! Memory for large values, for those of the tasks, and for what is used seldom, beside that of all other statics, which would not hold them.
//!
//! It is no `.bss`, as its clock may be off when that is cleared: a board clears it when it starts.
#![allow(unsafe_code, reason = "the memory is known to the linker")]

unsafe extern "C" {
    static mut _large_start: u32;
    static mut _large_end: u32;
    static mut _tasks_start: u32;
    static mut _tasks_end: u32;
    static mut _seldom_start: u32;
    static mut _seldom_end: u32;
}

/// Makes zeros of all of it.
///
/// # Safety
/// To be called once, before anybody uses what is there. All zero must be a valid beginning of every static there, as it is
/// of a `StaticCell`.
pub unsafe fn clear() {
    let large = (&raw mut _large_start, &raw mut _large_end);
    let tasks = (&raw mut _tasks_start, &raw mut _tasks_end);
    let seldom = (&raw mut _seldom_start, &raw mut _seldom_end);
    for (start, end) in [large, tasks, seldom] {
        // SAFETY: the linker has put all on whole words, and nobody uses what is between them yet.
        unsafe { start.write_bytes(0, end.addr().saturating_sub(start.addr()) / size_of::<u32>()) };
    }
}
