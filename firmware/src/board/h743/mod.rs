//! The vehicle's board: a Nucleo-H743ZI with an STM32H743ZI (UM1974, RM0433), and a CAN transceiver at PD0 and PD1.
//!
//! The LAN8742A is on RMII as the board has it. Both caches are on.
#![allow(unsafe_code, reason = "memory for DMA and the vectors of executors have no safe owner")]

mod can;
mod clocks;
mod ethernet;
mod faults;
mod flash;
mod memory_clocks;
mod memory_protection;
mod random;
mod restart_cause;
mod watchdog;

pub use can::{CanParts, FdCanPort as Can};
pub use ethernet::Ethernet;
pub use flash::SettingsFlash as Flash;
pub use random::seed;
pub use watchdog::Watchdog;

use core::mem::MaybeUninit;

use defmt_rtt as _;
use embassy_executor::{InterruptExecutor, SendSpawner};
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::peripherals::FDCAN1;
use embassy_stm32::{bind_interrupts, eth, interrupt};

use super::{RestartCause, Troubles};
use clocks::Source;
use ethernet::{Queue, Wires};

/// What the board is called on the bus.
pub const NAME: &str = "Nucleo-H743ZI";
/// Where the stack begins.
pub const STACK_TOP: u32 = 0x2002_0000;
/// Bytes at its end that nobody may touch.
pub const STACK_GUARD: usize = 4096;

bind_interrupts!(
    /// Which driver handles which interrupt.
    pub struct Interrupts {
    ETH => eth::InterruptHandler;
    FDCAN1_IT0 => embassy_stm32::can::IT0InterruptHandler<FDCAN1>;
    FDCAN1_IT1 => embassy_stm32::can::IT1InterruptHandler<FDCAN1>;
});

#[unsafe(link_section = ".ethernet")]
static mut QUEUE: MaybeUninit<Queue> = MaybeUninit::uninit();

static BUS_TASKS: InterruptExecutor = InterruptExecutor::new();
static NETWORK_TASKS: InterruptExecutor = InterruptExecutor::new();

/// Neither of these peripherals is used: their interrupts run the executors.
#[interrupt]
unsafe fn UART7() {
    // SAFETY: this is the interrupt with which the executor is started.
    unsafe { BUS_TASKS.on_interrupt() };
}

#[interrupt]
unsafe fn UART8() {
    // SAFETY: this is the interrupt with which the executor is started.
    unsafe { NETWORK_TASKS.on_interrupt() };
}

/// What the board has.
pub struct Board {
    /// FDCAN1, which begins when its bit rate is known.
    pub can: CanParts,
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

/// Starts everything but the tasks.
#[must_use]
pub fn start(mut core: cortex_m::Peripherals) -> Board {
    // First of all: whatever hangs from here on ends in a restart.
    let watchdog = Watchdog::unleash();
    let restart_cause = restart_cause::take();
    memory_clocks::enable();
    memory_protection::enable(&mut core.MPU);
    core.SCB.enable_icache();
    core.SCB.enable_dcache(&mut core.CPUID);
    let source = Source::find();
    let peripherals = embassy_stm32::init(source.config());
    memory_clocks::disable_unused();
    // Drivers above the bus, the bus above the network, the network above everything else.
    interrupt::TIM2.set_priority(Priority::P2);
    interrupt::FDCAN1_IT0.set_priority(Priority::P1);
    interrupt::FDCAN1_IT1.set_priority(Priority::P1);
    interrupt::ETH.set_priority(Priority::P6);
    let can = CanParts {
        controller: peripherals.FDCAN1,
        pins: (peripherals.PD0, peripherals.PD1),
        clock_tolerance: source.tolerance(),
    };
    // SAFETY: this function is called once, as it takes the peripherals, and nobody else knows the queue. All zero is
    // what `PacketQueue::init` makes of it, and a valid one.
    let queue = unsafe {
        let queue = &mut *(&raw mut QUEUE);
        Queue::init(queue);
        queue.assume_init_mut()
    };
    let wires = Wires {
        controller: peripherals.ETH,
        management: peripherals.ETH_SMA,
        data: (
            peripherals.PA1,
            peripherals.PA7,
            peripherals.PC4,
            peripherals.PC5,
            peripherals.PG13,
            peripherals.PB13,
            peripherals.PG11,
        ),
        managed: (peripherals.PA2, peripherals.PC1),
    };
    let ethernet = Ethernet::start(queue, wires);
    let flash = Flash::open(peripherals.FLASH);
    let troubles = Troubles { has_ethernet: ethernet.is_alive(), has_crystal: source.has_crystal() };
    Board { can, ethernet, flash, watchdog, restart_cause, troubles }
}

/// Starts the tasks of the bus. Call once.
#[must_use]
pub fn bus_tasks() -> SendSpawner {
    interrupt::UART7.set_priority(Priority::P4);
    BUS_TASKS.start(interrupt::UART7)
}

/// Starts the tasks of the network. Call once.
#[must_use]
pub fn network_tasks() -> SendSpawner {
    interrupt::UART8.set_priority(Priority::P8);
    NETWORK_TASKS.start(interrupt::UART8)
}

/// Starts again.
pub fn restart() -> ! {
    cortex_m::peripheral::SCB::sys_reset()
}
