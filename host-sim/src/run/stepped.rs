//! The loops of bus and localiser in a time that somebody else tells, without threads, files and ports: what they do depends on nothing
//! but what they are given, and a day takes minutes.

use std::collections::VecDeque;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::Receiver;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use agv_controller::{Bus, ControllerIdentity, Laser, LaserOrder, Localization, TELEGRAM, Troubles, carried_map};
use agv_core::localizer::{LentCapacities, Localizer};
use agv_core::maps::Landmark;
use agv_core::measurement::Time;
use agv_core::record::Header;
use agv_core::state::PoseOutput;
use agv_settings::Settings;
use agv_wire::can::frame::{AnyFrame, Frame};
use agv_wire::nav350::{Revolution, Step};

use super::bus_loop::BusLoop;
use super::bus_port::BusPort;
use super::exchange::{Exchange, LaserQueues, Queues};
use super::kept::{self, Kept};
use super::localizer_loop::LocalizerLoop;
use super::log_file::Beginning;
use super::log_passing::LogDisk;
use super::log_queue::{LogReader, divide, log_queue};
use super::log_ring::{Job, RingOptions, log_ring, write_incidents};
use super::{HARDWARE, PeriodFigures, RunError, SOFTWARE};
use crate::bus::{Bus as BusLine, BusError};
use crate::link::clock::Clock;

/// What is on its way to the loop of the bus, and what it has sent.
#[derive(Default)]
struct Line {
    heard: VecDeque<Frame>,
    sent: VecDeque<Frame>,
}

/// The end of the line at the loop of the bus.
struct LineEnd(Arc<Mutex<Line>>);

fn locked(line: &Mutex<Line>) -> MutexGuard<'_, Line> {
    line.lock().unwrap_or_else(PoisonError::into_inner)
}

impl BusLine for LineEnd {
    fn send(&mut self, frame: &AnyFrame) -> Result<(), BusError> {
        locked(&self.0).sent.extend(frame.classic().copied());
        Ok(())
    }

    fn receive(&mut self, _deadline: Instant) -> Result<Option<AnyFrame>, BusError> {
        Ok(locked(&self.0).heard.pop_front().map(AnyFrame::from))
    }
}

/// A controller whose time is told.
pub struct Stepped<'a> {
    hand: &'static AtomicU64,
    line: Arc<Mutex<Line>>,
    exchange: &'a Exchange,
    bus: BusLoop<'a>,
    localizer: LocalizerLoop<'a, &'a mut Localizer<LentCapacities<'a>>>,
    laser: Box<Laser<TELEGRAM>>,
    revolution: Box<Revolution>,
    queues: LaserQueues,
    log: LogReader,
    disk: LogDisk<'a>,
    /// Incidents that are to be written.
    incidents: Option<(Receiver<Job>, &'a RingOptions)>,
    note: &'a (dyn Fn(&str) + Sync),
    /// Its settings, as its store has them.
    pub settings: &'a Settings,
    /// Its map.
    pub landmarks: &'a [Landmark],
}

impl Stepped<'_> {
    /// Lets the clock show `now`.
    pub fn set_time(&self, now: Time) {
        self.hand.store(now.micros(), Ordering::Relaxed);
    }

    /// One step of the loop of the bus, in which it hears a frame or none, and what the localiser does then. `take` is told what was
    /// sent.
    pub fn step_bus(&mut self, heard: Option<&Frame>, mut take: impl FnMut(&Frame)) {
        locked(&self.line).heard.extend(heard.copied());
        self.bus.step(Instant::now(), self.localizer.note);
        self.localize();
        loop {
            let next = locked(&self.line).sent.pop_front();
            let Some(frame) = next else { break };
            take(&frame);
        }
    }

    /// The connection to the laser is open.
    pub fn connect_laser(&mut self) {
        self.laser.connected(self.exchange.now());
    }

    /// Takes bytes of the laser, maybe none, does what is due, and what the localiser does then. `order` is told what its connection is to
    /// do.
    pub fn step_laser(&mut self, bytes: &[u8], mut order: impl FnMut(LaserOrder<&[u8]>)) {
        if let Some(speed) = self.exchange.newest_laser_speed() {
            self.laser.set_speed(speed);
        }
        let now = self.exchange.now();
        let mut rest = bytes;
        loop {
            let taken = self.laser.receive(rest, now);
            rest = rest.get(taken..).unwrap_or_default();
            loop {
                let Self { laser, revolution, queues, exchange, .. } = self;
                match laser.poll(now, revolution) {
                    Step::Wait(_) => break,
                    Step::Connect => {
                        order(LaserOrder::Connect);
                        break;
                    }
                    Step::Disconnect(_) => order(LaserOrder::Disconnect),
                    Step::Send(bytes) => order(LaserOrder::Send(bytes)),
                    Step::Revolution => queues.pass_on(revolution, exchange),
                    Step::Report(_) => {}
                }
                self.exchange.set_laser(self.laser.watch());
                self.localize();
            }
            if rest.is_empty() || taken == 0 {
                break;
            }
        }
        self.exchange.set_laser(self.laser.watch());
    }

    /// Lets the localiser do all that there is to do.
    fn localize(&mut self) {
        while self.localizer.step() {}
        let now = self.exchange.now();
        while let Some(item) = self.log.full.receive() {
            self.disk.take(&item, now);
            self.log.give_back(item);
        }
        self.disk.look(now);
        if let Some((jobs, options)) = &self.incidents {
            write_incidents(jobs.try_iter(), options, self.note);
        }
    }

    /// The pose that was published last.
    #[must_use]
    pub fn pose(&self) -> Option<PoseOutput> {
        self.exchange.pose()
    }

    /// Poses so far, the times between them, and deadlines that passed without one.
    #[must_use]
    pub fn poses(&self) -> (u64, PeriodFigures, u64) {
        let periods = &self.exchange.periods;
        (periods.poses(), periods.figures(), periods.missed())
    }

    /// Events, revolutions and records of the log that were left out, as there was no room.
    #[must_use]
    pub fn left_out(&self) -> [u32; 3] {
        [self.exchange.lost_events(), self.exchange.lost_revolutions(), self.exchange.lost_records()]
    }
}

/// Makes a controller of a store, whose time is what `hand` shows in microseconds, and lends it to `drive`. Its start is kept in the
/// store as any other. What is to be kept of the drive is in `ring`; `note` is told what happens to it.
///
/// # Errors
/// If the store cannot be read, or the folders of the ring cannot be made.
pub fn run_stepped<T>(
    store: &Path,
    hand: &'static AtomicU64,
    ring: Option<&RingOptions>,
    note: &(dyn Fn(&str) + Sync),
    drive: impl FnOnce(&mut Stepped) -> T,
) -> Result<T, RunError> {
    let Kept { controller, settings, contours, communication, is_sound, .. } = kept::read(store)?;
    let (landmarks, starts) = (controller.landmarks, controller.starts);
    let controller = Mutex::new(controller);
    let clock = Clock::by_hand(hand);
    let (exchange, queues) = Exchange::new(clock, Arc::new(AtomicBool::new(false)), &[]);
    let exchange = &exchange;
    let Queues { localizer: localizer_queues, laser: laser_queues, .. } = queues;
    let capacities = <Localizer<LentCapacities>>::CAPACITIES;
    let header = Header { software: SOFTWARE, parameters: &settings.parameters, capacities };
    let beginning = Beginning { header, landmarks };
    let (mut log, mut log_reader) = log_queue(exchange, beginning.frames());
    let (log_ring, jobs) = ring.map(|options| log_ring(options, beginning, starts)).transpose()?.unzip();
    if let Some(RingOptions { part, .. }) = ring {
        let size = size_of::<Localizer<LentCapacities>>();
        let limits = settings.parameters.alert_limits;
        divide((&mut log, &mut log_reader), &settings.parameters, limits, (*part, size));
    }
    let identity =
        ControllerIdentity { hardware: HARDWARE, serial: 0, map: carried_map(landmarks), stored: communication };
    let troubles = Troubles { are_settings_lost: !is_sound, ..Troubles::default() };
    let bus = Bus::new(&settings, identity, troubles, exchange.now());
    let line = Arc::new(Mutex::new(Line::default()));
    let end = Arc::clone(&line);
    let open = Box::new(move || Ok(Box::new(LineEnd(Arc::clone(&end))) as Box<dyn BusLine>));
    let port = BusPort::new(open, clock, &bus.nodes(), &bus.other_frames());
    let period = Duration::from_millis(settings.publishing_period.max(1).into());
    let mut localizer = Box::new(Localizer::<LentCapacities>::new(settings.parameters));
    // As in a run: what cannot be lent is not there.
    let _ = localizer.lend_landmarks(landmarks);
    let _ = contours.map(|bytes| localizer.lend_contours(bytes));
    let mut localizer_loop = LocalizerLoop {
        localization: Localization::new(&mut *localizer, &settings),
        exchange,
        queues: localizer_queues,
        log,
        waiting: None,
        kept: None,
        landmarks,
        note,
    };
    localizer_loop.tell();
    let mut stepped = Stepped {
        hand,
        line,
        exchange,
        bus: BusLoop::new((bus, port), exchange, &controller, period),
        localizer: localizer_loop,
        laser: Box::new(Laser::new(settings.laser.configuration())),
        revolution: Box::default(),
        queues: laser_queues,
        log: log_reader,
        disk: LogDisk::begin(None, log_ring, note),
        incidents: jobs.zip(ring),
        note,
        settings: &settings,
        landmarks,
    };
    let outcome = drive(&mut stepped);
    let Stepped { disk, incidents, .. } = stepped;
    disk.finish(exchange.now());
    if let Some((jobs, options)) = incidents {
        write_incidents(jobs.try_iter(), options, note);
    }
    Ok(outcome)
}
