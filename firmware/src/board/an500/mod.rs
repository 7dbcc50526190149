//! ARM's MPS2 with the image AN500: a Cortex-M7 that QEMU emulates (ARM DAI 0500, "Example Cortex-M7 SMM on V2M-MPS2+").

pub mod flash;
pub mod host_file;
pub mod interrupts;
pub mod lan9118;
pub mod log_file;
pub mod panic;
mod registers;
pub mod stopwatch;
pub mod time_driver;
pub mod uart;
pub mod watchdog;

pub use flash::FileFlash as Flash;
pub use lan9118::Lan9118 as Ethernet;
pub use uart::SlcanPort as Can;
pub use watchdog::Watchdog;

use super::{RestartCause, Troubles};
use defmt_semihosting as _;
use embassy_executor::SendSpawner;
use interrupts::{BUS_TASKS, Interrupt, NETWORK_TASKS};

/// What the board has.
pub struct Board {
    /// The bus: SLCAN on the first serial line, as there is no CAN.
    pub can: Can,
    /// Ethernet.
    pub ethernet: Ethernet,
    /// Where settings are kept.
    pub flash: Flash,
    /// The watchdog, which runs.
    pub watchdog: Watchdog,
    /// Why the program has started.
    pub restart_cause: RestartCause,
    /// What does not work.
    pub troubles: Troubles,
}

/// What the board is called on the bus.
pub const NAME: &str = "MPS2 AN500";
/// Where the stack begins.
pub const STACK_TOP: u32 = 0x2040_0000;
/// Bytes at its end that nobody may touch.
pub const STACK_GUARD: usize = 0;

/// Starts everything but the tasks.
#[must_use]
pub fn start(mut core: cortex_m::Peripherals) -> Board {
    let mut watchdog = Watchdog::new();
    watchdog.unleash();
    time_driver::start();
    uart::start();
    // Before its interrupt is let through, which it holds active until it is set up.
    let ethernet = Ethernet::start([2, 0, 0, 0, 0, 1]);
    interrupts::enable(&mut core.NVIC);
    Board {
        can: uart::SlcanPort,
        ethernet,
        flash: Flash::open(),
        watchdog,
        restart_cause: RestartCause::Other,
        troubles: Troubles::NONE,
    }
}

/// The same in every run, so that runs can be repeated.
#[must_use]
pub const fn seed() -> u64 {
    0x5eed
}

/// Starts the tasks of the bus. Call once.
#[must_use]
pub fn bus_tasks() -> SendSpawner {
    BUS_TASKS.start(Interrupt::BusTasks)
}

/// Starts the tasks of the network. Call once.
#[must_use]
pub fn network_tasks() -> SendSpawner {
    NETWORK_TASKS.start(Interrupt::NetworkTasks)
}

/// Starts again.
pub fn restart() -> ! {
    cortex_m::peripheral::SCB::sys_reset()
}
