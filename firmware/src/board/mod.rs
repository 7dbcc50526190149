//! Boards: pins, clocks, peripherals, memory.
//!
//! A board is a folder with a type that implements [`Board`], and a line here. Its `memory.x`, which `build.rs` gives to
//! the linker, says where the stack is and how much of its end is out of reach (`_stack_start`, `_stack_end`,
//! `_stack_guard`), where large values and those of the tasks go (`.large`, `.tasks`), what is used seldom (`.seldom`), and what
//! outlives a restart (`.retained`).

#[cfg(feature = "an500")]
pub mod an500;
#[cfg(feature = "h723")]
mod h723;
#[cfg(feature = "h743")]
mod h743;
pub mod large;
pub mod retained;
pub mod stack;
#[cfg(feature = "stm32h7")]
mod stm32h7;

#[cfg(feature = "an500")]
pub use an500::An500 as Current;
#[cfg(feature = "h723")]
pub use h723::Nucleo as Current;
#[cfg(feature = "h743")]
pub use h743::Nucleo as Current;

use agv_controller::LineSet;
use agv_core::localizer::Capacities;
use agv_settings::patient_flash::PatientFlash;
use embassy_executor::SendSpawner;
use embassy_net_driver::Driver;
use embedded_hal::digital::{InputPin, OutputPin};
use embedded_hal::i2c::I2c;

use crate::app::can_port::CanPort;

/// The watchdog bites when it was not fed for so long, us: longer than a page of flash takes to erase.
pub const WATCHDOG_PERIOD: u32 = 8_000_000;

/// A board, as the program sees it.
pub trait Board: Sized + 'static {
    /// What it is called on the bus.
    const NAME: &'static str;
    /// Whether the processor goes on while the settings' flash is erased or written. It stands still if the program is in the
    /// same bank.
    const RUNS_WHILE_FLASH_WORKS: bool;

    /// How much there is room for.
    type Capacities: Capacities + 'static;
    /// The bus before its bit rate is known.
    type CanParts;
    /// The bus.
    type Can: CanPort + 'static;
    /// A discrete line that it sets.
    type Output: OutputPin + 'static;
    /// A discrete line that it reads.
    type Input: InputPin + 'static;
    /// The I2C before anybody wants it.
    type WireParts;
    /// The I2C, which has a gyro if the settings say so.
    type Wires: I2c + 'static;
    /// The network.
    type Ethernet: Driver + 'static;
    /// Where settings are kept, and maps of contours: at least two pages.
    type Flash: PatientFlash + 'static;
    /// The watchdog.
    type Watchdog: Watchdog;

    /// Starts everything but the tasks. The watchdog comes first, as what hangs behind it ends in a restart.
    fn start(core: cortex_m::Peripherals) -> Parts<Self>;

    /// Bytes of the map of contours, from that offset of its flash on. None if there are none. Call once, when they have been read through the
    /// flash; nobody writes them as long as the program runs.
    fn contour_bytes(offset: u32, length: u32) -> Option<&'static [u8]>;

    /// Takes part in the bus of that many kbit/s. Call once.
    fn take_part(can: Self::CanParts, bit_rate: u16) -> Self::Can;

    /// Starts the I2C, if the board has one. Call once.
    fn take_wires(parts: Self::WireParts) -> Option<Self::Wires>;

    /// Which of all boards it is; 0 if it does not know.
    fn serial() -> u32;

    /// A number for the network that nobody foresees.
    fn seed() -> u64;

    /// Starts the tasks of the bus, below the drivers and above all other tasks. Call once.
    fn bus_tasks() -> SendSpawner;

    /// Starts the tasks of the network, below those of the bus and above the loop. Call once.
    fn network_tasks() -> SendSpawner;
}

/// What restarts the board when it is not fed for [`WATCHDOG_PERIOD`].
pub trait Watchdog {
    /// Feeds it.
    fn feed(&mut self);
}

/// What a board has.
pub struct Parts<B: Board> {
    /// The bus, which begins when its bit rate is known.
    pub can: B::CanParts,
    /// The discrete lines, whose outputs are low.
    pub lines: LineSet<B::Output, B::Input>,
    /// The I2C, which begins when somebody wants it.
    pub wires: B::WireParts,
    /// The network.
    pub ethernet: B::Ethernet,
    /// Where settings are kept.
    pub flash: B::Flash,
    /// Where the map of contours is kept, if the board has room for one.
    pub contour_flash: Option<B::Flash>,
    /// The watchdog, which runs.
    pub watchdog: B::Watchdog,
    /// Why the program has started.
    pub restart_cause: RestartCause,
    /// What does not work.
    pub troubles: Troubles,
}

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
    /// The option bytes of the chip are as the vehicle needs them.
    pub are_options_right: bool,
}

impl Troubles {
    /// All of it.
    pub const NONE: Self = Self { has_ethernet: true, has_crystal: true, are_options_right: true };

    /// What does not work, as the bus tells it: a bit for each part.
    #[must_use]
    pub fn parts(&self) -> u8 {
        let Self { has_ethernet, has_crystal, are_options_right } = *self;
        u8::from(!has_ethernet) | u8::from(!has_crystal) << 1 | u8::from(!are_options_right) << 2
    }
}

/// Starts again.
pub fn restart() -> ! {
    cortex_m::peripheral::SCB::sys_reset()
}
