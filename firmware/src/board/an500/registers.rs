//! Access to registers.
#![allow(unsafe_code, reason = "registers are at fixed addresses")]

/// What a register holds.
///
/// # Safety
/// `base + offset` must be a register of the board, and reading it must be harmless to its owner.
#[must_use]
pub unsafe fn read(base: usize, offset: usize) -> u32 {
    // SAFETY: the caller knows the register.
    unsafe { ((base + offset) as *const u32).read_volatile() }
}

/// Writes a register.
///
/// # Safety
/// `base + offset` must be a register of the board that the caller owns.
pub unsafe fn write(base: usize, offset: usize, value: u32) {
    // SAFETY: the caller knows the register.
    unsafe { ((base + offset) as *mut u32).write_volatile(value) }
}
