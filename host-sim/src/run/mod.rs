//! The controller on a Linux machine: the parts of a board on three threads (bus, laser, localiser), settings and maps in a store
//! of files in the format of the boards' flash, and the same log stream and service port over TCP.
//!
//! Each thread that has a deadline neither waits for another nor takes memory once it runs: what passes between them is bounded and
//! made at the start, and what does not fit is counted.

mod attendance;
mod bus_loop;
mod bus_port;
mod configuration;
mod demonstration;
mod discrete;
mod exchange;
mod fault;
mod flash_file;
mod gyro;
mod incident;
mod incident_service;
mod kept;
mod kept_pose;
mod laser_loop;
mod localizer_loop;
mod log_file;
mod log_passing;
mod log_queue;
mod log_ring;
mod periods;
mod pose_line;
mod real_time;
mod service_port;
mod state_keeper;
mod status;
mod stepped;

use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use agv_controller::{Bus, ControllerIdentity, Localization, Troubles, carried_map};
use agv_core::integrity::AlertLimits;
use agv_core::localizer::{LentCapacities, Localizer};
use agv_core::record::{Header, LANDMARKS_A_RECORD, Record};
use agv_core::state::{LaserHealth, PoseOutput};
use agv_settings::map_identity;
use serde::Serialize;

pub use attendance::attend;
pub use bus_port::OpenBus;
pub use configuration::{Configuration, ConfigurationError, RecordingConfiguration};
pub use demonstration::{Demonstration, DemonstrationError};
pub use discrete::{DiscreteConfiguration, DiscretePort, LineError, LineName};
pub use exchange::BusState;
pub use fault::Fault;
pub use flash_file::{FlashFile, FlashFileError, Refused};
pub use gyro::{GyroConfiguration, GyroOpenError, GyroPort, OpenGyro};
pub use incident::Incident;
pub use kept::{CONTOURS, FLASH, Kept, SOFTWARE, StoreFolderError, read};
pub use kept_pose::{KeptPose, POSE};
pub use log_ring::RingOptions;
pub use periods::{PeriodClock, PeriodFigures, Periods};
pub use pose_line::{PoseLine, PoseSinkError};
pub use real_time::RealTime;
pub use status::{LeftOut, Status, StatusBoard, serve_status};
pub use stepped::{Stepped, run_stepped};

use self::bus_loop::BusLoop;
use self::bus_port::BusPort;
use self::exchange::{Exchange, Queues, Task};
use self::localizer_loop::LocalizerLoop;
use self::log_file::{Beginning, LogFile};
use self::log_passing::{LogDisk, pass_log};
use self::log_queue::{divide, log_queue};
use self::log_ring::{log_ring, write_incidents};
use self::pose_line::{PoseSinks, levels};
use self::real_time::Lacks;
use crate::drive::mode_name;
use crate::link::clock::Clock;
use crate::live::relay::Relay;
use crate::log::LogError;

/// What it is called on the bus.
const HARDWARE: &str = "linux";

/// Stack of the thread of the localiser, bytes: it builds the localiser, which is large.
const LARGE_STACK: usize = 32 << 20;
/// Stack of the other threads with deadlines, bytes.
const STACK: usize = 2 << 20;

/// How often it is looked after.
const LOOK: Duration = Duration::from_millis(20);

/// Why a controller does not run.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// Its store.
    #[error(transparent)]
    Store(#[from] StoreFolderError),
    /// Poses cannot be told to other programs.
    #[error(transparent)]
    Poses(#[from] PoseSinkError),
    /// The log cannot be begun.
    #[error(transparent)]
    Log(#[from] LogError),
    /// A port of this machine is taken.
    #[error("{address}: {source}; another address is set with {setting}")]
    Port {
        /// Where it was to listen.
        address: SocketAddr,
        /// What the operating system says.
        source: io::Error,
        /// What sets another one.
        setting: &'static str,
    },
    /// A thread cannot be made.
    #[error("a thread cannot be made: {0}")]
    Thread(io::Error),
    /// A thread has ended by a panic.
    #[error("the thread of the {0} has broken down")]
    Panicked(&'static str),
}

/// Where a controller listens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ports {
    /// At the ports of its settings, on that address.
    Set(IpAddr),
    /// At any free ports, on loopback.
    Any,
}

/// What a controller runs with, beside its settings.
pub struct Options {
    /// Folder of its store.
    pub store: PathBuf,
    /// What opens its bus.
    pub open_bus: OpenBus,
    /// Its discrete lines, if it has any.
    pub lines: Option<Box<dyn DiscretePort>>,
    /// What opens its own gyro, if it has one.
    pub gyro: Option<OpenGyro>,
    /// Where it listens.
    pub ports: Ports,
    /// Priorities, cores and memory.
    pub real_time: RealTime,
    /// Who is sent each pose as a datagram.
    pub datagrams: Vec<SocketAddr>,
    /// The socket of Unix at which poses are told.
    pub socket: Option<PathBuf>,
    /// What is written of it.
    pub logs: Logs,
}

/// What is written of a run.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Logs {
    /// The log of the whole run, from the first event on.
    pub whole: Option<PathBuf>,
    /// The last minutes, and incidents.
    pub ring: Option<RingOptions>,
}

/// A controller that runs.
pub struct Running<'a> {
    exchange: &'a Exchange,
    /// Where its log stream is.
    pub log: SocketAddr,
    /// Where its service port is.
    pub service: SocketAddr,
    /// Starts of this store so far.
    pub starts: u32,
    /// Identity of its map.
    pub map: u32,
    /// Folder of its store.
    pub store: &'a Path,
    /// What its vehicle can live with.
    pub limits: AlertLimits,
    begin: Instant,
}

/// How a controller is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Condition {
    /// The pose that was published last.
    pub pose: Option<PoseOutput>,
    /// Whether a pose that rests on what is seen was ever published.
    pub was_localised: bool,
    /// Poses on the bus.
    pub poses: u64,
    /// Times between them.
    pub periods: PeriodFigures,
    /// Deadlines that passed without one.
    pub missed: u64,
    /// The bus.
    pub bus: BusState,
    /// The laser.
    pub laser: LaserHealth,
    /// Whether the vehicle stands.
    pub is_standing: bool,
    /// Events, revolutions and records of the log that were left out, as there was no room.
    pub left_out: [u32; 3],
}

impl Running<'_> {
    /// How it is.
    #[must_use]
    pub fn condition(&self) -> Condition {
        let Self { exchange, .. } = self;
        Condition {
            pose: exchange.pose(),
            was_localised: exchange.was_localised(),
            poses: exchange.periods.poses(),
            periods: exchange.periods.figures(),
            missed: exchange.periods.missed(),
            bus: exchange.bus(),
            laser: exchange.laser_health(),
            is_standing: exchange.is_standing(),
            left_out: [exchange.lost_events(), exchange.lost_revolutions(), exchange.lost_records()],
        }
    }

    /// The next fault, or end of one, that the bus was told of and that nobody has asked for yet.
    #[must_use]
    pub fn next_fault(&self) -> Option<Fault> {
        self.exchange.next_fault()
    }

    /// Poses on the bus so far.
    #[must_use]
    pub fn poses(&self) -> u64 {
        self.exchange.periods.poses()
    }

    /// Time since its start.
    #[must_use]
    pub fn uptime(&self) -> Duration {
        self.begin.elapsed()
    }

    /// Whether bus, laser and localiser have all run since this last said so, and lines and gyro where there are any.
    #[must_use]
    pub fn have_all_run(&self) -> bool {
        self.exchange.have_all_run()
    }

    /// Whether it ends.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.exchange.is_over()
    }
}

/// What a run has brought.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Poses on the bus.
    pub poses: u64,
    /// Times from one to the next.
    pub period_ms: PeriodFigures,
    /// Deadlines that passed without a pose.
    pub missed: u64,
    /// What the last pose rested on.
    pub mode: &'static str,
    /// Its protection level of the position, mm; none without a bound.
    pub level_mm: Option<f64>,
    /// How often it has started again.
    pub restarts: u32,
    /// Whether a pose that rests on what is seen was ever published.
    #[serde(skip)]
    pub was_localised: bool,
    /// Whether somebody wants it to start again.
    #[serde(skip)]
    pub is_restart_wanted: bool,
}

/// Ends everything if its thread ends by a panic: without one of them a controller is none.
struct Alarm<'a>(&'a Exchange);

impl Drop for Alarm<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.stop();
        }
    }
}

fn listen(ports: Ports, port: u16, setting: &'static str) -> Result<TcpListener, RunError> {
    let address = match ports {
        Ports::Set(address) => SocketAddr::new(address, port),
        Ports::Any => SocketAddr::from((Ipv4Addr::LOCALHOST, 0)),
    };
    TcpListener::bind(address).map_err(|source| RunError::Port { address, source, setting })
}

fn address_of(listener: &TcpListener) -> SocketAddr {
    listener.local_addr().unwrap_or_else(|_| SocketAddr::from((Ipv4Addr::UNSPECIFIED, 0)))
}

/// Runs a controller until `is_stopped`, or until somebody at its service port wants it to start again. `note` is told what
/// happens to it, a line each; `watch` is called once, beside it, to look on.
///
/// # Errors
/// If something that it needs cannot be had at the start, or a thread breaks down.
pub fn run(
    options: Options,
    is_stopped: &Arc<AtomicBool>,
    note: &(dyn Fn(&str) + Sync),
    watch: impl FnOnce(&Running) + Send,
) -> Result<Summary, RunError> {
    let Kept { controller, settings, contours, communication, is_sound, remarks } = kept::read(&options.store)?;
    remarks.iter().for_each(|remark| note(remark));
    let log_listener = listen(options.ports, settings.network.log_port, "can.log_port or listen")?;
    let service_listener = listen(options.ports, settings.network.service_port, "service.port or listen")?;
    let sinks = PoseSinks::new(&options.datagrams, options.socket.as_deref())?;
    let (log, service) = (address_of(&log_listener), address_of(&service_listener));
    let lacks = Lacks::default();
    let map = map_identity(controller.landmarks);
    let kept_pose = KeptPose::read(&options.store, map);
    let store = options.store;
    let (landmarks, starts) = (controller.landmarks, controller.starts);
    let lining = options.lines.is_some().then_some(Task::Lines);
    let besides: Vec<Task> = lining.into_iter().chain(options.gyro.is_some().then_some(Task::Gyro)).collect();
    let (exchange, queues) = Exchange::new(Clock::new(1.0), Arc::clone(is_stopped), &besides);
    let exchange = &exchange;
    let Queues { localizer: localizer_queues, laser: laser_queues, poses } = queues;
    let controller = Mutex::new(controller);
    let relay = Relay::of(log_listener).map_err(|source| RunError::Port { address: log, source, setting: "listen" })?;
    let capacities = <Localizer<LentCapacities>>::CAPACITIES;
    let header = Header { software: SOFTWARE, parameters: &settings.parameters, capacities };
    relay.pass(&Record::Header(header));
    landmarks.chunks(LANDMARKS_A_RECORD).for_each(|piece| relay.pass(&Record::Landmarks(piece)));
    let beginning = Beginning { header, landmarks };
    let (mut log_writer, mut log_reader) = log_queue(exchange, beginning.frames());
    let log_file = options.logs.whole.as_deref().map(|path| LogFile::begin(path, &beginning)).transpose()?;
    let ring_options = options.logs.ring;
    let incidents_folder = ring_options.as_ref().map(RingOptions::incidents);
    let ring = ring_options.as_ref().map(|ring| log_ring(ring, beginning, starts)).transpose()?;
    if let Some(ring) = &ring_options {
        let size = size_of::<Localizer<LentCapacities>>();
        let ends = (&mut log_writer, &mut log_reader);
        divide(ends, &settings.parameters, settings.parameters.alert_limits, (ring.part, size));
    }
    if options.real_time.lock_memory {
        real_time::lock_memory(&lacks);
    }
    let identity =
        ControllerIdentity { hardware: HARDWARE, serial: 0, map: carried_map(landmarks), stored: communication };
    let (begin, start) = (Instant::now(), exchange.now());
    let troubles = Troubles { are_settings_lost: !is_sound, ..Troubles::default() };
    let bus = Bus::new(&settings, identity, troubles, start);
    let port = BusPort::new(options.open_bus, exchange.clock, &bus.nodes(), &bus.other_frames());
    let period = Duration::from_millis(settings.publishing_period.max(1).into());
    let bus_loop = BusLoop::new((bus, port), exchange, &controller, period);
    let laser = SocketAddr::from((settings.network.laser, settings.network.laser_port)).to_string();
    let configuration = settings.laser.configuration();
    let limits = settings.parameters.alert_limits;
    let (real_time, lacks, relay) = (options.real_time, &lacks, &relay);
    let store = store.as_path();
    let relay_stop = AtomicBool::new(false);
    let outcome = std::thread::scope(|scope| {
        let named = |name: &str, stack| std::thread::Builder::new().name(name.to_owned()).stack_size(stack);
        let settings = &settings;
        let localizing = named("localizer", LARGE_STACK).spawn_scoped(scope, move || {
            let _alarm = Alarm(exchange);
            let mut localizer = Box::new(Localizer::<LentCapacities>::new(settings.parameters));
            if localizer.lend_landmarks(landmarks).is_err() {
                note("the map has more landmarks than the localiser takes, or one that is not finite");
            }
            if let Some(bytes) = contours
                && let Err(error) = localizer.lend_contours(bytes)
            {
                note(&format!("the map of contours cannot be used: {error:?}"));
            }
            let localization = Box::new(Localization::new(&mut *localizer, settings));
            let localizer_loop = LocalizerLoop {
                localization: *localization,
                exchange,
                queues: localizer_queues,
                log: log_writer,
                waiting: None,
                kept: kept_pose.map(|pose| (pose, *settings.parameters.lasers.first())),
                landmarks,
                note,
            };
            real_time::enter("localiser", real_time.localizer_priority, real_time.localizer_core, lacks);
            localizer_loop.run();
        });
        let lasing = named("laser", STACK).spawn_scoped(scope, move || {
            let _alarm = Alarm(exchange);
            real_time::enter("laser", real_time.laser_priority, real_time.laser_core, lacks);
            laser_loop::run(&laser, configuration, exchange, &laser_queues, note);
        });
        let busing = named("bus", STACK).spawn_scoped(scope, || {
            let _alarm = Alarm(exchange);
            real_time::enter("bus", real_time.bus_priority, real_time.bus_core, lacks);
            bus_loop.run(begin, note);
        });
        let lining = options.lines.map(|lines| {
            named("lines", STACK).spawn_scoped(scope, move || {
                let _alarm = Alarm(exchange);
                real_time::enter("lines", real_time.bus_priority, None, lacks);
                discrete::run(lines, exchange);
            })
        });
        let turning = options.gyro.map(|open| {
            let gyro = open(settings);
            named("gyro", STACK).spawn_scoped(scope, move || {
                let _alarm = Alarm(exchange);
                real_time::enter("gyro", real_time.bus_priority, None, lacks);
                gyro::run(gyro, exchange, note);
            })
        });
        let besides = || lining.iter().chain(&turning);
        if localizing.is_err() || lasing.is_err() || busing.is_err() || besides().any(Result::is_err) {
            exchange.stop();
        }
        let (ring, incidents) = ring.unzip();
        let passing = scope.spawn(move || pass_log(&log_reader, relay, LogDisk::begin(log_file, ring, note), exchange));
        if let Some((incidents, ring_options)) = incidents.zip(ring_options.as_ref()) {
            scope.spawn(move || write_incidents(incidents, ring_options, note));
        }
        scope.spawn(|| relay.serve(&relay_stop));
        scope.spawn(|| service_port::serve(&service_listener, &controller, incidents_folder.as_deref(), exchange));
        scope.spawn(|| service_port::keep(&controller, exchange, note));
        scope.spawn(move || sinks.run(poses, &limits, exchange));
        scope.spawn(move || watch(&Running { exchange, log, service, starts, map, store, limits, begin }));
        while !exchange.is_over() {
            std::thread::sleep(LOOK);
            lacks.take().iter().for_each(|lack| note(&format!("real time: {lack}")));
        }
        let mut broken = None;
        let threads = [("localiser", localizing), ("laser", lasing), ("bus", busing)];
        for (name, thread) in threads
            .into_iter()
            .chain(lining.map(|thread| ("discrete lines", thread)))
            .chain(turning.map(|thread| ("gyro", thread)))
        {
            let ended = thread.map(std::thread::ScopedJoinHandle::join);
            broken = match ended {
                Ok(Ok(())) => broken,
                Ok(Err(_)) => broken.or(Some(RunError::Panicked(name))),
                Err(error) => broken.or(Some(RunError::Thread(error))),
            };
        }
        // Listeners are given all of the log.
        let _ = passing.join();
        relay_stop.store(true, std::sync::atomic::Ordering::Relaxed);
        broken.map_or(Ok(()), Err)
    });
    outcome?;
    let pose = exchange.pose();
    Ok(Summary {
        poses: exchange.periods.poses(),
        period_ms: exchange.periods.figures(),
        missed: exchange.periods.missed(),
        mode: pose.map_or(mode_name(agv_core::state::Mode::NotLocalised), |pose| mode_name(pose.mode)),
        level_mm: pose.and_then(|pose| levels(&pose)[0]).map(|level| 1e3 * level),
        restarts: 0,
        was_localised: exchange.was_localised(),
        is_restart_wanted: exchange.is_restart_wanted(),
    })
}
