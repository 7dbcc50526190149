//! The firmware of the vehicle.
#![no_std]
#![no_main]

use core::panic::PanicInfo;

use agv_controller::{ControllerIdentity, LineSet, Troubles, carried_map};
use agv_core::localizer::{self, Parameters};
use agv_core::maps::Landmark;
use agv_firmware::app::announced_flash::AnnouncedFlash;
use agv_firmware::app::capacities::has_slots;
use agv_firmware::app::exchange::RevolutionReceiver;
use agv_firmware::app::laser::LaserMemory;
use agv_firmware::app::log_stream::{Beginning, LONGEST, LogMemory, LogQueue, LogWriter};
use agv_firmware::app::service::{BoardActions, ServiceMemory, SharedController};
use agv_firmware::app::settings::KeptMap;
use agv_firmware::app::supervision::Supervisor;
use agv_firmware::app::throttle::Throttle;
use agv_firmware::app::{
    bus, exchange, gyro, laser, localize, log_stream, service, settings, shared_settings, supervision,
};
use agv_firmware::board::{self, Board, Current, Parts, RestartCause, Watchdog, retained, stack};
use agv_settings::service::Controller;
use agv_settings::{GyroConnection, Settings, block_on};
use agv_wire::can::controller_node::CommunicationParameters;
use agv_wire::nav350::Revolution;
use embassy_executor::Spawner;
use embassy_net::{Config, Ipv4Address, Ipv4Cidr, Runner, Stack, StaticConfigV4};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::zerocopy_channel::Channel;
use static_cell::StaticCell;

#[panic_handler]
fn on_panic(info: &PanicInfo) -> ! {
    cortex_m::interrupt::disable();
    retained::keep(info);
    board::restart()
}

defmt::timestamp!("{=u64:us}", embassy_time::Instant::now().as_micros());

/// Connections of the service port.
const CONNECTIONS: usize = 2;

type Can = <Current as Board>::Can;
type Lines = LineSet<<Current as Board>::Output, <Current as Board>::Input>;
type Wires = <Current as Board>::Wires;
type Ethernet = <Current as Board>::Ethernet;
type Flash = AnnouncedFlash<<Current as Board>::Flash>;
type Capacities = <Current as Board>::Capacities;
type Localizer = localizer::Localizer<Capacities>;
type Localization = localize::Localization<Capacities>;

static LOCALIZER: StaticCell<Localizer> = StaticCell::new();
static CHANNEL: StaticCell<Channel<'static, CriticalSectionRawMutex, Revolution>> = StaticCell::new();

/// Large values apart from the localiser, what tasks work with, and what is used seldom, in whichever memory the board has for each. A cell without a value is
/// all zero, which is what that memory begins with.
#[allow(unsafe_code, reason = "the section is that of the boards' memory for such values")]
mod large {
    use agv_firmware::app::laser::LaserMemory;
    use agv_firmware::app::log_stream::{LONGEST, LogMemory, LogQueue};
    use agv_firmware::app::service::{ServiceMemory, SharedController};
    use agv_firmware::app::settings::KeptMap;
    use agv_settings::Settings;
    use agv_wire::nav350::Revolution;
    use embassy_net::StackResources;
    use static_cell::StaticCell;

    use super::{CONNECTIONS, Flash, Localization};

    #[unsafe(link_section = ".large")]
    pub static MAP: StaticCell<KeptMap> = StaticCell::new();
    #[unsafe(link_section = ".seldom")]
    pub static CONTROLLER: StaticCell<SharedController<Flash>> = StaticCell::new();
    #[unsafe(link_section = ".seldom")]
    pub static SETTINGS: StaticCell<Settings> = StaticCell::new();
    #[unsafe(link_section = ".large")]
    pub static REVOLUTIONS: StaticCell<[Revolution; 1]> = StaticCell::new();
    #[unsafe(link_section = ".tasks")]
    pub static LOG: StaticCell<LogMemory> = StaticCell::new();
    #[unsafe(link_section = ".tasks")]
    pub static LOG_QUEUE: StaticCell<LogQueue> = StaticCell::new();
    #[unsafe(link_section = ".tasks")]
    pub static FRAME: StaticCell<[u8; LONGEST]> = StaticCell::new();
    #[unsafe(link_section = ".seldom")]
    pub static SERVICES: StaticCell<[ServiceMemory; CONNECTIONS]> = StaticCell::new();
    #[unsafe(link_section = ".tasks")]
    pub static RESOURCES: StaticCell<StackResources<{ CONNECTIONS + 4 }>> = StaticCell::new();
    #[unsafe(link_section = ".tasks")]
    pub static LASER: StaticCell<LaserMemory> = StaticCell::new();
    #[unsafe(link_section = ".tasks")]
    pub static LOCALIZATION: StaticCell<Localization> = StaticCell::new();
}

/// What all tasks of the network know.
#[derive(Clone, Copy)]
struct Shared {
    settings: &'static Settings,
    controller: &'static SharedController<Flash>,
    landmarks: &'static [Landmark],
    log: &'static LogQueue,
}

#[embassy_executor::task]
async fn bus_task(
    can: Can,
    lines: Lines,
    settings: &'static Settings,
    controller: &'static SharedController<Flash>,
    identity: ControllerIdentity,
    troubles: Troubles,
) -> ! {
    bus::run(identity, can, lines, settings, controller, troubles).await
}

#[embassy_executor::task]
async fn gyro_task(wires: Wires, settings: &'static Settings) -> ! {
    gyro::run(wires, settings).await
}

#[embassy_executor::task]
async fn save_task(controller: &'static SharedController<Flash>) -> ! {
    shared_settings::keep(controller).await
}

#[embassy_executor::task]
async fn network_task(mut runner: Runner<'static, Throttle<Ethernet>>) -> ! {
    runner.run().await
}

#[embassy_executor::task]
async fn watch_task() -> ! {
    supervision::watch_network().await
}

#[embassy_executor::task]
async fn laser_task(stack: Stack<'static>, revolutions: exchange::RevolutionSender, settings: &'static Settings) -> ! {
    let memory = large::LASER.init_with(|| LaserMemory::new(settings.laser.configuration()));
    laser::run(stack, memory, revolutions, &settings.network).await
}

#[embassy_executor::task]
async fn log_task(stack: Stack<'static>, shared: Shared) -> ! {
    let Shared { settings, landmarks, log, .. } = shared;
    let beginning = Beginning { parameters: &settings.parameters, capacities: Localizer::CAPACITIES, landmarks };
    log_stream::run(stack, large::LOG.init_with(LogMemory::new), log, settings.network.log_port, beginning).await
}

#[embassy_executor::task(pool_size = CONNECTIONS)]
async fn service_task(stack: Stack<'static>, memory: &'static mut ServiceMemory, shared: Shared) -> ! {
    let actions = BoardActions { forget_panic: retained::forget, restart: board::restart };
    service::run(stack, memory, shared.controller, shared.settings.network.service_port, actions).await
}

/// Starts the network on the executor that runs it: its tasks may not move to another one.
#[embassy_executor::task]
#[allow(unsafe_code, reason = "the spawner of an interrupt executor is to be had in no other way")]
async fn start_network(
    ethernet: Ethernet,
    wires: Option<Wires>,
    revolutions: exchange::RevolutionSender,
    shared: Shared,
) {
    // SAFETY: this task was made by embassy's macro, so its context is embassy's.
    let spawner = unsafe { Spawner::for_current_executor() }.await;
    if let Some(wires) = wires {
        spawner.spawn(gyro_task(wires, shared.settings).expect("the task runs once"));
    }
    // Whoever asks at the service port waits until the start is counted: its number is part of what keys answer for. That may
    // take as long as a page takes to erase: so nothing else waits for it where the processor goes on meanwhile, and where it
    // does not, it was done before the bus heard anything.
    let mut counted = shared.controller.try_lock().expect("nobody else knows the controller");
    let network = &shared.settings.network;
    let config = Config::ipv4_static(StaticConfigV4 {
        address: Ipv4Cidr::new(Ipv4Address::from(network.address), network.prefix),
        gateway: Some(Ipv4Address::from(network.gateway)),
        dns_servers: heapless::Vec::new(),
    });
    let resources = large::RESOURCES.init_with(embassy_net::StackResources::new);
    let (stack, runner) = embassy_net::new(Throttle::new(ethernet), config, resources, Current::seed());
    spawner.spawn(watch_task().expect("the task runs once"));
    spawner.spawn(save_task(shared.controller).expect("the task runs once"));
    spawner.spawn(network_task(runner).expect("the task runs once"));
    spawner.spawn(laser_task(stack, revolutions, shared.settings).expect("the task runs once"));
    spawner.spawn(log_task(stack, shared).expect("the task runs once"));
    for memory in large::SERVICES.init_with(|| [const { ServiceMemory::new() }; CONNECTIONS]) {
        spawner.spawn(service_task(stack, memory, shared).expect("there are as many tasks as connections"));
    }
    if Current::RUNS_WHILE_FLASH_WORKS {
        settings::count_start(&mut counted).await;
    }
}

/// What the loop works with.
struct Vehicle {
    localization: &'static mut Localization,
    revolutions: RevolutionReceiver,
    watchdog: <Current as Board>::Watchdog,
    supervisor: Supervisor,
}

// Large values are built in functions of their own: on the stack they have room one after the other, not all at once.

#[inline(never)]
fn build_localizer(parameters: &Parameters) -> &'static mut Localizer {
    LOCALIZER.init_with(|| Localizer::new(*parameters))
}

#[inline(never)]
fn build_localization(
    localizer: &'static mut Localizer,
    settings: &Settings,
    log: LogWriter,
    reads_flash: bool,
) -> &'static mut Localization {
    large::LOCALIZATION.init_with(|| Localization {
        localization: agv_controller::Localization::new(localizer, settings),
        log,
        reads_flash,
    })
}

#[inline(never)]
fn share(controller: Controller<Flash>) -> (&'static Settings, &'static SharedController<Flash>) {
    let settings = large::SETTINGS.init_with(|| controller.settings.clone());
    (settings, large::CONTROLLER.init_with(|| SharedController::new(controller)))
}

/// The map of contours, where it lies.
fn contour_bytes(controller: &Controller<Flash>) -> Option<&'static [u8]> {
    let store = controller.contours.as_ref()?;
    let found = store.found()?;
    Current::contour_bytes(store.offset(found.copy), found.length)
}

/// What has brought this start about, and others before it that nobody has forgotten yet, if it was no good; empty if nothing was
/// wrong.
fn failure(cause: RestartCause) -> &'static str {
    if cause == RestartCause::Watchdog {
        match retained::read() {
            "" => retained::keep(&supervision::stood_still()),
            before => retained::keep(&format_args!("{}; before: {before}", supervision::stood_still())),
        }
    }
    retained::read()
}

/// What is kept in flash.
struct Kept {
    settings: &'static Settings,
    controller: &'static SharedController<Flash>,
    landmarks: &'static [Landmark],
    /// The map of contours.
    contours: Option<&'static [u8]>,
    /// How the controller shall speak on the bus.
    communication: Option<CommunicationParameters>,
}

#[inline(never)]
fn read_flash(
    flash: <Current as Board>::Flash,
    contour_flash: Option<<Current as Board>::Flash>,
    failure: &'static str,
) -> Kept {
    let announced = |flash| AnnouncedFlash::new(flash, !Current::RUNS_WHILE_FLASH_WORKS);
    let map = large::MAP.init_with(KeptMap::new);
    let (flash, contour_flash) = (announced(flash), contour_flash.map(announced));
    let mut controller = settings::read(flash, contour_flash, map, failure, has_slots::<Capacities>());
    if !Current::RUNS_WHILE_FLASH_WORKS {
        block_on(settings::count_start(&mut controller));
    }
    let communication = settings::communication(&mut controller);
    let landmarks = controller.landmarks;
    let contours = contour_bytes(&controller);
    let (settings, controller) = share(controller);
    Kept { settings, controller, landmarks, contours, communication }
}

#[inline(never)]
fn start() -> Vehicle {
    let core = cortex_m::Peripherals::take().expect("the program begins once");
    let Parts { can, lines, wires, ethernet, flash, contour_flash, watchdog, restart_cause, troubles } =
        Current::start(core);
    let failure = failure(restart_cause);
    let supervisor = Supervisor::start();
    let Kept { settings, controller, landmarks, contours, communication } = read_flash(flash, contour_flash, failure);
    let localizer = build_localizer(&settings.parameters);
    if localizer.lend_landmarks(landmarks).is_err() {
        defmt::error!("the map has more landmarks than the localiser takes, or one that is not finite");
        exchange::set_settings_sound(false);
    }
    if let Some(bytes) = contours
        && let Err(error) = localizer.lend_contours(bytes)
    {
        defmt::error!("the map of contours cannot be used: {}", error as u8);
        exchange::set_settings_sound(false);
    }
    let channel = CHANNEL.init_with(|| Channel::new(large::REVOLUTIONS.init_with(|| [Revolution::new()])));
    let (sender, revolutions) = channel.split();
    let queue: &LogQueue = large::LOG_QUEUE.init_with(LogQueue::new);
    let log = LogWriter::new(large::FRAME.init_with(|| [0; LONGEST]), queue, landmarks.len());
    let localization = build_localization(localizer, settings, log, contours.is_some());
    exchange::publish(localization.localization.estimate());
    let troubles = Troubles {
        has_panicked: !failure.is_empty(),
        damaged_parts: troubles.parts(),
        are_settings_lost: !exchange::are_settings_sound(),
    };
    let can = Current::take_part(can, settings.bit_rate);
    let identity = ControllerIdentity {
        hardware: Current::NAME,
        serial: Current::serial(),
        map: carried_map(landmarks),
        stored: communication,
    };
    Current::bus_tasks()
        .spawn(bus_task(can, lines, settings, controller, identity, troubles).expect("the task runs once"));
    let shared = Shared { settings, controller, landmarks, log: queue };
    let has_own_gyro = settings.parameters.gyro.is_fitted && settings.gyro_connection != GyroConnection::Can;
    let wires = if has_own_gyro { Current::take_wires(wires) } else { None };
    Current::network_tasks().spawn(start_network(ethernet, wires, sender, shared).expect("the task runs once"));
    Vehicle { localization, revolutions, watchdog, supervisor }
}

#[inline(never)]
fn run(vehicle: Vehicle) -> ! {
    let Vehicle { localization, mut revolutions, mut watchdog, mut supervisor } = vehicle;
    // What builds the large values goes deeper than what runs then: each is told apart.
    defmt::info!("stack at the start: {} of {} bytes", stack::deepest(), stack::reserved());
    stack::paint();
    let mut deepest = 0;
    loop {
        let is_busy = localization.step(&mut revolutions);
        if supervisor.is_due() {
            watchdog.feed();
            let depth = stack::deepest();
            if depth > deepest {
                deepest = depth;
                defmt::info!("stack: {} of {} bytes", deepest, stack::reserved());
            }
        }
        if is_busy {
            continue;
        }
        // An interrupt that comes between looking and sleeping ends the sleep at once.
        cortex_m::interrupt::free(|_| {
            if exchange::BUS_EVENTS.is_empty() && revolutions.is_empty() {
                cortex_m::asm::wfi();
            }
        });
    }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    stack::paint();
    run(start())
}
