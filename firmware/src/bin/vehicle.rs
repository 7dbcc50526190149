//! The firmware of the vehicle, on the emulated board.
#![no_std]
#![no_main]

use core::panic::PanicInfo;

use agv_core::localizer::{Localizer, OutputPredictor};
use agv_core::wire::nav350::Revolution;
use agv_firmware::app::laser::LaserMemory;
use agv_firmware::app::log_stream::{LONGEST, LogMemory, LogWriter};
use agv_firmware::app::settings::Settings;
use agv_firmware::app::{bus, exchange, laser, localize, log_stream};
use agv_firmware::board::an500::interrupts::{self, BUS_TASKS, Interrupt, NETWORK_TASKS};
use agv_firmware::board::an500::lan9118::Lan9118;
use agv_firmware::board::an500::uart::SlcanPort;
use agv_firmware::board::an500::{settings_file, time_driver, uart};
use defmt_semihosting as _;
use embassy_executor::Spawner;
use embassy_net::{Config, Ipv4Address, Ipv4Cidr, Runner, Stack, StackResources, StaticConfigV4};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::zerocopy_channel::Channel;
use static_cell::{ConstStaticCell, StaticCell};

#[panic_handler]
fn on_panic(info: &PanicInfo) -> ! {
    defmt::error!("{}", defmt::Display2Format(info));
    cortex_m_semihosting::debug::exit(cortex_m_semihosting::debug::EXIT_FAILURE);
    loop {
        cortex_m::asm::wfi();
    }
}

defmt::timestamp!("{=u64:us}", embassy_time::Instant::now().as_micros());

static SETTINGS: StaticCell<Settings> = StaticCell::new();
static LOCALIZER: StaticCell<Localizer> = StaticCell::new();
static REVOLUTIONS: ConstStaticCell<[Revolution; 2]> = ConstStaticCell::new([const { Revolution::new() }; 2]);
static CHANNEL: StaticCell<Channel<'static, CriticalSectionRawMutex, Revolution>> = StaticCell::new();
static LASER: StaticCell<LaserMemory> = StaticCell::new();
static LOG: ConstStaticCell<LogMemory> = ConstStaticCell::new(LogMemory::new());
static FRAME: ConstStaticCell<[u8; LONGEST]> = ConstStaticCell::new([0; LONGEST]);
static RESOURCES: StaticCell<StackResources<4>> = StaticCell::new();

#[embassy_executor::task]
async fn bus_task(settings: &'static Settings) -> ! {
    bus::run(SlcanPort, settings).await
}

#[embassy_executor::task]
async fn network_task(mut runner: Runner<'static, Lan9118>) -> ! {
    runner.run().await
}

#[embassy_executor::task]
async fn laser_task(stack: Stack<'static>, revolutions: exchange::RevolutionSender, settings: &'static Settings) -> ! {
    laser::run(stack, LASER.init_with(LaserMemory::new), revolutions, settings).await
}

#[embassy_executor::task]
async fn log_task(stack: Stack<'static>, settings: &'static Settings) -> ! {
    log_stream::run(stack, LOG.take(), settings).await
}

/// Starts the network on the executor that runs it: its tasks may not move to another one.
#[embassy_executor::task]
#[allow(unsafe_code, reason = "the spawner of an interrupt executor is to be had in no other way")]
async fn start_network(device: Lan9118, revolutions: exchange::RevolutionSender, settings: &'static Settings) {
    // SAFETY: this task was made by embassy's macro, so its context is embassy's.
    let spawner = unsafe { Spawner::for_current_executor() }.await;
    let address = Ipv4Cidr::new(Ipv4Address::new(10, 0, 2, 15), 24);
    let config = Config::ipv4_static(StaticConfigV4 {
        address,
        gateway: Some(Ipv4Address::new(10, 0, 2, 2)),
        dns_servers: heapless::Vec::new(),
    });
    let resources = RESOURCES.init_with(StackResources::new);
    let (stack, runner) = embassy_net::new(device, config, resources, 0x5eed);
    spawner.spawn(network_task(runner).expect("the task runs once"));
    spawner.spawn(laser_task(stack, revolutions, settings).expect("the task runs once"));
    spawner.spawn(log_task(stack, settings).expect("the task runs once"));
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut core = cortex_m::Peripherals::take().expect("the program begins once");
    let settings: &'static Settings = SETTINGS.init_with(settings_file::read);
    let localizer = LOCALIZER.init_with(|| Localizer::new(settings.parameters));
    localizer.add_landmarks(settings.landmarks).expect("the map has room for the landmarks");
    exchange::start(OutputPredictor::new(&settings.parameters));
    exchange::update(&localizer.outputs().pose);
    let channel = CHANNEL.init_with(|| Channel::new(REVOLUTIONS.take()));
    let (sender, mut receiver) = channel.split();
    let mut log = LogWriter::new(FRAME.take());
    time_driver::start();
    uart::start();
    // Before its interrupt is let through, which it holds active until it is set up.
    let device = Lan9118::start([2, 0, 0, 0, 0, 1]);
    interrupts::enable(&mut core.NVIC);
    let bus = BUS_TASKS.start(Interrupt::BusTasks);
    bus.spawn(bus_task(settings).expect("the task runs once"));
    let network = NETWORK_TASKS.start(Interrupt::NetworkTasks);
    network.spawn(start_network(device, sender, settings).expect("the task runs once"));
    defmt::info!("{} landmarks", settings.landmarks.len());
    loop {
        if !localize::step(localizer, &mut receiver, &mut log) {
            // An interrupt that comes between looking and sleeping ends the sleep at once.
            cortex_m::interrupt::free(|_| {
                if exchange::BUS_EVENTS.is_empty() && receiver.is_empty() {
                    cortex_m::asm::wfi();
                }
            });
        }
    }
}
