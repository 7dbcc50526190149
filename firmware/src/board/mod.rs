//! Boards: pins, clocks, peripherals, memory.
//!
//! Each board has the same names for the program that runs on all of them: `start` gives its CAN port, Ethernet controller,
//! flash and watchdog, which runs, `seed` a number for the network, `bus_tasks` and `network_tasks` spawn tasks above the localiser, `restart` starts again.

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

/// Why the program has started.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RestartCause {
    /// Power has come.
    Power,
    /// The program itself wanted it, or has failed.
    Software,
    /// The watchdog was not fed.
    Watchdog,
    /// Something else, or nobody knows.
    Other,
}

/// What of the board works.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Troubles {
    /// There is an Ethernet controller with a PHY that gives it a clock.
    pub has_ethernet: bool,
    /// The clock is that of a crystal.
    pub has_crystal: bool,
}

impl Troubles {
    /// All of it.
    pub const NONE: Self = Self { has_ethernet: true, has_crystal: true };

    /// Whether anything does not work.
    #[must_use]
    pub fn are_there(&self) -> bool {
        *self != Self::NONE
    }
}
