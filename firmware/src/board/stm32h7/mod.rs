//! Nucleo boards with an STM32H7 and 144 pins (UM1974, UM2407), and a CAN transceiver at PD0 and PD1: what they share.
//!
//! The LAN8742A is on RMII as the boards have it. Both caches are on. What a chip has and another has not is its [`Chip`].
//! Sections are those of RM0433; RM0468 has the same registers where no other section is named.
#![allow(unsafe_code, reason = "memory for DMA and the vectors of executors have no safe owner")]

mod can;
mod clocks;
mod ethernet;
mod faults;
mod flash;
mod i2c_wires;
mod lines;
mod memory_protection;
mod option_bytes;
mod phy;
mod random;
mod restart_cause;
mod unused_clocks;
mod watchdog;

pub use clocks::common as common_clocks;
pub use flash::Bank;
pub use memory_protection::Region;

use core::marker::PhantomData;
use core::mem::MaybeUninit;

use agv_core::localizer::Capacities;
use defmt_rtt as _;
use embassy_executor::{InterruptExecutor, SendSpawner};
use embassy_stm32::gpio::Input;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::peripherals::FDCAN1;
use embassy_stm32::{Config, bind_interrupts, eth, interrupt};

use super::{Board, Parts, Troubles, large};
use can::{CanParts, FdCanPort};
use clocks::Source;
use ethernet::{Ethernet, Queue, Wires};
use flash::Pages;
use i2c_wires::{I2cParts, I2cWires};
use lines::{LinePins, ShownOutput};
use watchdog::IndependentWatchdog;

/// What a chip has, and its board is called.
pub trait Chip: 'static {
    /// What the board is called on the bus.
    const NAME: &'static str;
    /// The bank of flash that the settings and the map of contours are in.
    const SETTINGS: Bank;
    /// Memories that are not cached.
    const NOT_CACHED: &'static [Region];
    /// How much there is room for.
    type Capacities: Capacities + 'static;

    /// Switches on memories whose clocks are off after a reset. Without its clock a store there is a bus fault.
    fn enable_memories();

    /// Does what this revision of the silicon needs before anything else is done.
    fn mend() {}

    /// The clock tree, from the debugger's clock of 8 MHz or from the chip's own oscillator of 64 MHz. FDCAN has
    /// [`can::CLOCK`] from PLL 1.
    fn clock_tree(has_crystal: bool) -> Config;
}

bind_interrupts!(
    /// Which driver handles which interrupt.
    struct Interrupts {
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

/// A board with that chip.
pub struct Nucleo<C>(PhantomData<C>);

impl<C: Chip> Board for Nucleo<C> {
    const NAME: &'static str = C::NAME;
    const RUNS_WHILE_FLASH_WORKS: bool = !C::SETTINGS.has_program();

    type Capacities = C::Capacities;
    type CanParts = CanParts;
    type Can = FdCanPort;
    type Output = ShownOutput;
    type Input = Input<'static>;
    type WireParts = I2cParts;
    type Wires = I2cWires;
    type Ethernet = Ethernet;
    type Flash = Pages<C>;
    type Watchdog = IndependentWatchdog;

    fn start(mut core: cortex_m::Peripherals) -> Parts<Self> {
        let watchdog = IndependentWatchdog::unleash();
        let restart_cause = restart_cause::take();
        C::enable_memories();
        // SAFETY: this function is called once, as it takes the peripherals, and no large value is used yet.
        unsafe { large::clear() };
        memory_protection::enable(&mut core.MPU, C::NOT_CACHED);
        core.SCB.enable_icache();
        core.SCB.enable_dcache(&mut core.CPUID);
        C::mend();
        let source = Source::find();
        let peripherals = embassy_stm32::init(C::clock_tree(source.has_crystal()));
        source.watch();
        unused_clocks::disable();
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
        let lines = LinePins {
            pose_valid: peripherals.PD15,
            pose_valid_led: peripherals.PB0,
            within_docking_limits: peripherals.PD14,
            fault: peripherals.PA6,
            fault_led: peripherals.PB14,
            standstill: peripherals.PG9,
            reset: peripherals.PG14,
        };
        let i2c = I2cParts { controller: peripherals.I2C1, clock: peripherals.PB8, data: peripherals.PB9 };
        // SAFETY: this function is called once, and nobody else knows the queue. All zero is what `PacketQueue::init` makes
        // of it, and a valid one.
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
        let (flash, contour_flash) = flash::open(peripherals.FLASH);
        let troubles = Troubles {
            has_ethernet: ethernet.is_alive(),
            has_crystal: source.has_crystal(),
            are_options_right: option_bytes::are_right(),
        };
        let lines = lines.start();
        Parts { can, lines, wires: i2c, ethernet, flash, contour_flash, watchdog, restart_cause, troubles }
    }

    fn contour_bytes(offset: u32, length: u32) -> Option<&'static [u8]> {
        flash::contour_bytes(offset as usize, length as usize)
    }

    fn take_part(can: CanParts, bit_rate: u16) -> FdCanPort {
        can.start(bit_rate)
    }

    fn take_wires(parts: I2cParts) -> Option<I2cWires> {
        Some(parts.start())
    }

    fn serial() -> u32 {
        random::serial()
    }

    fn seed() -> u64 {
        random::seed()
    }

    fn bus_tasks() -> SendSpawner {
        interrupt::UART7.set_priority(Priority::P4);
        BUS_TASKS.start(interrupt::UART7)
    }

    fn network_tasks() -> SendSpawner {
        interrupt::UART8.set_priority(Priority::P8);
        NETWORK_TASKS.start(interrupt::UART8)
    }
}
