//! Boards: pins, clocks, peripherals, memory.

#[cfg(feature = "an500")]
pub mod an500;
