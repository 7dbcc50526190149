//! The vehicle's board: a Nucleo-H743ZI with an STM32H743ZI (UM1974, RM0433), and a CAN transceiver at PD0 and PD1.
//!
//! The LAN8742A is on RMII as the board has it. 480 MHz from the debugger's 8 MHz clock. Both caches are on; the memory of
//! the Ethernet's DMA is not cached.
#![allow(unsafe_code, reason = "memory for DMA and the vectors of executors have no safe owner")]

mod caches;
mod can;
mod flash;
mod memory_clocks;

pub use can::FdCanPort as Can;
pub use flash::SettingsFlash as Flash;

use core::mem::MaybeUninit;

use defmt_rtt as _;
use embassy_executor::{InterruptExecutor, SendSpawner};
use embassy_stm32::eth::{self, GenericPhy, PacketQueue, Sma};
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::peripherals::{ETH, ETH_SMA, FDCAN1, IWDG1};
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllDiv, PllMul, PllPreDiv, PllSource, Sysclk, VoltageScale, mux,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Config, bind_interrupts, interrupt, uid};

bind_interrupts!(
    /// Which driver handles which interrupt.
    pub struct Interrupts {
    ETH => eth::InterruptHandler;
    FDCAN1_IT0 => embassy_stm32::can::IT0InterruptHandler<FDCAN1>;
    FDCAN1_IT1 => embassy_stm32::can::IT1InterruptHandler<FDCAN1>;
});

/// The Ethernet controller with its PHY.
pub type Ethernet = eth::Ethernet<'static, ETH, GenericPhy<Sma<'static, ETH_SMA>>>;

/// Frames that wait to be sent, and that were received.
type Queue = PacketQueue<3, 6>;

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
    /// FDCAN1.
    pub can: Can,
    /// Ethernet.
    pub ethernet: Ethernet,
    /// Where settings are kept.
    pub flash: Flash,
    /// The watchdog, not started.
    pub watchdog: Watchdog,
}

fn clocks() -> Config {
    let mut config = Config::default();
    let rcc = &mut config.rcc;
    rcc.hse = Some(Hse { freq: Hertz(8_000_000), mode: HseMode::Bypass });
    rcc.hsi = None;
    rcc.csi = false;
    rcc.pll1 = Some(Pll {
        source: PllSource::HSE,
        prediv: PllPreDiv::DIV1,
        mul: PllMul::MUL120,
        fracn: None,
        // 480 MHz for the core, 80 MHz for FDCAN.
        divp: Some(PllDiv::DIV2),
        divq: Some(PllDiv::DIV12),
        divr: None,
    });
    rcc.sys = Sysclk::PLL1_P;
    rcc.d1c_pre = AHBPrescaler::DIV1;
    rcc.ahb_pre = AHBPrescaler::DIV2;
    rcc.apb1_pre = APBPrescaler::DIV2;
    rcc.apb2_pre = APBPrescaler::DIV2;
    rcc.apb3_pre = APBPrescaler::DIV2;
    rcc.apb4_pre = APBPrescaler::DIV2;
    rcc.voltage_scale = VoltageScale::Scale0;
    rcc.mux.fdcansel = mux::Fdcansel::PLL1_Q;
    config
}

/// Starts everything but the tasks.
#[must_use]
pub fn start(mut core: cortex_m::Peripherals) -> Board {
    memory_clocks::enable();
    caches::enable(&mut core);
    let peripherals = embassy_stm32::init(clocks());
    // Drivers above the bus, the bus above the network, the network above everything else.
    interrupt::TIM2.set_priority(Priority::P2);
    interrupt::FDCAN1_IT0.set_priority(Priority::P1);
    interrupt::FDCAN1_IT1.set_priority(Priority::P1);
    interrupt::ETH.set_priority(Priority::P6);
    let can = Can::start(peripherals.FDCAN1, peripherals.PD0, peripherals.PD1, Interrupts);
    // SAFETY: this function is called once, as it takes the peripherals, and nobody else knows the queue. All zero is
    // what `PacketQueue::init` makes of it, and a valid one.
    let queue = unsafe {
        let queue = &mut *(&raw mut QUEUE);
        Queue::init(queue);
        queue.assume_init_mut()
    };
    let ethernet = Ethernet::new(
        queue,
        peripherals.ETH,
        Interrupts,
        peripherals.PA1,
        peripherals.PA7,
        peripherals.PC4,
        peripherals.PC5,
        peripherals.PG13,
        peripherals.PB13,
        peripherals.PG11,
        address(),
        peripherals.ETH_SMA,
        peripherals.PA2,
        peripherals.PC1,
    );
    let flash = Flash::new(peripherals.FLASH);
    let watchdog = Watchdog(IndependentWatchdog::new(peripherals.IWDG1, super::WATCHDOG_PERIOD));
    Board { can, ethernet, flash, watchdog }
}

/// A locally administered MAC address, from the chip's own number.
fn address() -> [u8; 6] {
    let sum = |part: &[u8]| part.iter().fold(0x5A_u8, |sum, byte| sum.rotate_left(3) ^ byte);
    let [.., a, b, c, d, e, f, g, h] = uid::uid();
    [2, sum(&[a, b]), sum(&[c, d]), e ^ sum(&[a]), f ^ g, h]
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

/// The watchdog.
pub struct Watchdog(IndependentWatchdog<'static, IWDG1>);

impl Watchdog {
    /// Starts it: from now on it must be fed.
    pub fn unleash(&mut self) {
        self.0.unleash();
    }

    /// Feeds it.
    pub fn feed(&mut self) {
        self.0.pet();
    }
}

/// Starts again.
pub fn restart() -> ! {
    cortex_m::peripheral::SCB::sys_reset()
}
