//! ARM's MPS2 with the image AN500: a Cortex-M7 that QEMU emulates (ARM DAI 0500, "Example Cortex-M7 SMM on V2M-MPS2+").

pub mod flash;
pub mod host_file;
pub mod interrupts;
pub mod lan9118;
pub mod log_file;
pub mod no_lines;
pub mod no_wires;
pub mod panic;
mod registers;
pub mod stopwatch;
pub mod time_driver;
pub mod uart;
pub mod watchdog;

use core::ffi::CStr;

use agv_controller::LineSet;
use agv_core::localizer::LentCapacities;
use defmt_semihosting as _;
use embassy_executor::SendSpawner;
use embedded_storage::nor_flash::ReadNorFlash;
use static_cell::ConstStaticCell;

use super::{Board, Parts, RestartCause, Troubles, large};
use flash::FileFlash;
use interrupts::{BUS_TASKS, Interrupt, NETWORK_TASKS};
use lan9118::Lan9118;
use no_lines::NoPin;
use no_wires::NoWires;
use uart::SlcanPort;
use watchdog::ApbWatchdog;

/// Files of the flash.
const SETTINGS: &CStr = c"flash.bin";
const CONTOURS: &CStr = c"contours.bin";

/// The board, with room for what the vehicle's board has room for.
pub struct An500;

impl Board for An500 {
    const NAME: &'static str = "MPS2 AN500";
    const RUNS_WHILE_FLASH_WORKS: bool = true;

    type Capacities = LentCapacities<'static>;
    type CanParts = SlcanPort;
    type Can = SlcanPort;
    type Output = NoPin;
    type Input = NoPin;
    type WireParts = ();
    type Wires = NoWires;
    type Ethernet = Lan9118;
    type Flash = FileFlash;
    type Watchdog = ApbWatchdog;

    #[allow(unsafe_code, reason = "memory that the linker knows is to be cleared once")]
    fn start(mut core: cortex_m::Peripherals) -> Parts<Self> {
        let mut watchdog = ApbWatchdog::new();
        watchdog.unleash();
        // SAFETY: this function is called once, as it takes the peripherals, and no large value is used yet.
        unsafe { large::clear() };
        time_driver::start();
        uart::start();
        // Before its interrupt is let through, which it holds active until it is set up.
        let ethernet = Lan9118::start([2, 0, 0, 0, 0, 1]);
        interrupts::enable(&mut core.NVIC);
        Parts {
            can: SlcanPort,
            lines: LineSet::NONE,
            wires: (),
            ethernet,
            flash: FileFlash::open(SETTINGS),
            contour_flash: Some(FileFlash::open(CONTOURS)),
            watchdog,
            restart_cause: RestartCause::Other,
            troubles: Troubles::NONE,
        }
    }

    fn contour_bytes(offset: u32, length: u32) -> Option<&'static [u8]> {
        static BYTES: ConstStaticCell<[u8; flash::PAGE]> = ConstStaticCell::new([0; flash::PAGE]);
        let bytes = BYTES.take().get_mut(..length as usize)?;
        FileFlash::open(CONTOURS).read(offset, bytes).ok()?;
        Some(bytes)
    }

    /// Its bit rate is a matter of the adapter.
    fn take_part(can: SlcanPort, _bit_rate: u16) -> SlcanPort {
        can
    }

    fn take_wires((): ()) -> Option<NoWires> {
        None
    }

    fn serial() -> u32 {
        0
    }

    /// The same in every run, so that runs can be repeated.
    fn seed() -> u64 {
        0x5eed
    }

    fn bus_tasks() -> SendSpawner {
        BUS_TASKS.start(Interrupt::BusTasks)
    }

    fn network_tasks() -> SendSpawner {
        NETWORK_TASKS.start(Interrupt::NetworkTasks)
    }
}
