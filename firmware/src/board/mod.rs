//! Boards: pins, clocks, peripherals, memory.
//!
//! Each board has the same names for the program that runs on all of them: `start` gives its CAN port, Ethernet controller,
//! flash and watchdog, `bus_tasks` and `network_tasks` spawn tasks above the localiser, `restart` starts again.

#[cfg(feature = "an500")]
pub mod an500;
#[cfg(feature = "an500")]
pub use an500 as current;
#[cfg(feature = "h743")]
pub mod h743;
#[cfg(feature = "h743")]
pub use h743 as current;
pub mod retained;
pub mod stack;

/// The watchdog bites when it was not fed for so long, us: longer than a page of flash takes to erase.
pub const WATCHDOG_PERIOD: u32 = 8_000_000;
