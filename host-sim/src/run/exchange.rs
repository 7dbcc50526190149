//! What the threads pass to each other. Whoever has a deadline waits for nobody: queues are bounded, and what does not fit is
//! counted and left out; locks are held for the time of a copy, with the priority of
//! whoever waits for them.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::Thread;
use std::time::{Duration, Instant};

use agv_controller::{DiscreteInputs, DiscreteReport, Estimate, SentPose, Told};
use agv_core::measurement::{GyroSample, Time};
use agv_core::state::{LaserHealth, PoseOutput};
use agv_wire::can::controller_node::CommunicationParameters;
use agv_wire::nav350::{Revolution, SensorSpeed, SensorWatch};

use super::fault::Fault;
use super::periods::Periods;
use crate::link::clock::Clock;
use crate::sync::lock::Lock;
use crate::sync::queue::{Receiver, Sender, queue};

/// Events that wait for the localiser: a second of encoders and a gyro at 100 Hz each, and more.
const EVENTS: usize = 256;
/// Published poses that wait for the log.
const PUBLISHED_POSES: usize = 128;
/// Revolutions on their way: one that is written, one that waits and one that the localiser has.
const REVOLUTIONS: usize = 3;
/// Poses that wait to be told to other programs.
const POSES: usize = 128;

/// Faults that wait to be told to people.
const FAULTS: usize = 64;
/// Wishes for the settings to be stored that wait: each comes from a client that waits for its answer.
const SAVES: usize = 4;
/// Readings of the machine's own gyro that wait for the bus, which looks every millisecond.
const READINGS: usize = 16;

/// What must run, each a bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(super) enum Task {
    /// The bus: encoders, prediction, pose.
    Bus = 1,
    /// The laser.
    Laser = 2,
    /// The localiser.
    Localizer = 4,
    /// The discrete lines, if there are any.
    Lines = 8,
    /// The machine's own gyro, if it has one.
    Gyro = 16,
}

/// What runs on every vehicle.
const ALL: u32 = Task::Bus as u32 | Task::Laser as u32 | Task::Localizer as u32;

/// Whether there is a bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum BusState {
    /// It cannot be opened, or is lost.
    Lost,
    /// It is open.
    Open,
    /// Errors have driven the controller off it.
    Off,
}

/// The ends of the queues at the localiser.
pub(super) struct LocalizerQueues {
    pub events: Receiver<Told>,
    pub published: Receiver<SentPose>,
    pub revolutions: Receiver<Box<Revolution>>,
    pub free_revolutions: Sender<Box<Revolution>>,
}

/// The ends of the queues at the laser.
pub(super) struct LaserQueues {
    pub revolutions: Sender<Box<Revolution>>,
    pub free_revolutions: Receiver<Box<Revolution>>,
}

impl LaserQueues {
    /// Leaves a revolution to the localiser. If it is so far behind that there is no room, the revolution is lost and counted.
    pub fn pass_on(&self, revolution: &Revolution, exchange: &Exchange) {
        let Some(mut room) = self.free_revolutions.receive() else { return exchange.lose_revolution() };
        Revolution::clone_from(&mut room, revolution);
        // There are no more of them than there is room for.
        let _ = self.revolutions.send(room);
        exchange.wake_localizer();
    }
}

/// The other ends of the queues.
pub(super) struct Queues {
    pub localizer: LocalizerQueues,
    pub laser: LaserQueues,
    pub poses: Receiver<PoseOutput>,
}

/// What all threads know.
pub(super) struct Exchange {
    pub clock: Clock,
    pub periods: Periods,
    is_stopped: Arc<AtomicBool>,
    is_restart_wanted: AtomicBool,
    events: Sender<Told>,
    published: Sender<SentPose>,
    poses: Sender<PoseOutput>,
    faults: (Sender<Fault>, Receiver<Fault>),
    readings: (Sender<GyroSample>, Receiver<GyroSample>),
    has_failed: AtomicBool,
    localizer: OnceLock<Thread>,
    estimate: Lock<Option<Estimate>>,
    laser: Lock<SensorWatch>,
    laser_speed: Lock<Option<SensorSpeed>>,
    saves: (Sender<CommunicationParameters>, Receiver<CommunicationParameters>),
    saved: Lock<Option<bool>>,
    pose: Lock<Option<PoseOutput>>,
    bus: Lock<BusState>,
    is_standing: AtomicBool,
    was_localised: AtomicBool,
    lost_events: AtomicU32,
    lost_revolutions: AtomicU32,
    lost_records: AtomicU32,
    discrete_report: Lock<Option<DiscreteReport>>,
    discrete_inputs: Lock<Option<DiscreteInputs>>,
    seen: AtomicU32,
    /// Tasks that must run.
    wanted: u32,
}

impl Exchange {
    /// An exchange where nothing was said, and the other ends of its queues, of a controller that has these tasks besides.
    pub fn new(clock: Clock, is_stopped: Arc<AtomicBool>, besides: &[Task]) -> (Self, Queues) {
        let (events, events_end) = queue(EVENTS);
        let (published, published_end) = queue(PUBLISHED_POSES);
        let (poses, poses_end) = queue(POSES);
        let (revolutions, revolutions_end) = queue(REVOLUTIONS);
        let (faults, faults_end) = queue(FAULTS);
        let (readings, readings_end) = queue(READINGS);
        let (free_revolutions, free_revolutions_end) = queue(REVOLUTIONS);
        for _ in 0..REVOLUTIONS {
            // There is room for all.
            let _ = free_revolutions.send(Box::default());
        }
        let exchange = Self {
            clock,
            periods: Periods::default(),
            is_stopped,
            is_restart_wanted: AtomicBool::new(false),
            events,
            published,
            poses,
            faults: (faults, faults_end),
            readings: (readings, readings_end),
            has_failed: AtomicBool::new(false),
            localizer: OnceLock::new(),
            estimate: Lock::new(None),
            laser: Lock::new(SensorWatch::new()),
            laser_speed: Lock::new(None),
            saves: queue(SAVES),
            saved: Lock::new(None),
            pose: Lock::new(None),
            bus: Lock::new(BusState::Lost),
            is_standing: AtomicBool::new(true),
            was_localised: AtomicBool::new(false),
            lost_events: AtomicU32::new(0),
            lost_revolutions: AtomicU32::new(0),
            lost_records: AtomicU32::new(0),
            discrete_report: Lock::new(None),
            discrete_inputs: Lock::new(None),
            seen: AtomicU32::new(0),
            wanted: besides.iter().fold(ALL, |wanted, task| wanted | *task as u32),
        };
        let localizer = LocalizerQueues {
            events: events_end,
            published: published_end,
            revolutions: revolutions_end,
            free_revolutions,
        };
        let laser = LaserQueues { revolutions, free_revolutions: free_revolutions_end };
        (exchange, Queues { localizer, laser, poses: poses_end })
    }

    /// Now.
    pub fn now(&self) -> Time {
        self.clock.now()
    }

    /// Whether everything is to end, for ever or to start again.
    pub fn is_over(&self) -> bool {
        self.is_stopped.load(Ordering::Relaxed) || self.is_restart_wanted()
    }

    /// Ends everything, to start again.
    pub fn restart(&self) {
        self.is_restart_wanted.store(true, Ordering::Relaxed);
    }

    /// Whether somebody wants it to start again.
    pub fn is_restart_wanted(&self) -> bool {
        self.is_restart_wanted.load(Ordering::Relaxed)
    }

    /// Ends everything for ever.
    pub fn stop(&self) {
        self.is_stopped.store(true, Ordering::Relaxed);
    }

    /// This thread is the localiser's.
    pub fn be_localizer(&self) {
        let _ = self.localizer.set(std::thread::current());
    }

    /// There is something for the localiser to do.
    pub fn wake_localizer(&self) {
        if let Some(localizer) = self.localizer.get() {
            localizer.unpark();
        }
    }

    /// Leaves an event to the localiser. If it is so far behind that there is no room, the event is lost and counted.
    pub fn pass_on(&self, told: Told) {
        if self.events.send(told).is_err() {
            self.lost_events.fetch_add(1, Ordering::Relaxed);
        }
        self.wake_localizer();
    }

    /// How many events the localiser was too slow for.
    pub fn lost_events(&self) -> u32 {
        self.lost_events.load(Ordering::Relaxed)
    }

    /// A revolution came when there was no room for it.
    pub fn lose_revolution(&self) {
        self.lost_revolutions.fetch_add(1, Ordering::Relaxed);
    }

    /// How many revolutions the localiser was too slow for.
    pub fn lost_revolutions(&self) -> u32 {
        self.lost_revolutions.load(Ordering::Relaxed)
    }

    /// A record of the log found no room.
    pub fn lose_record(&self) {
        self.lost_records.fetch_add(1, Ordering::Relaxed);
    }

    /// How many records of the log were left out.
    pub fn lost_records(&self) -> u32 {
        self.lost_records.load(Ordering::Relaxed)
    }

    /// The bus was told of a fault, or of its end. Without room it is left out: the bus has it nevertheless.
    pub fn tell_fault(&self, fault: Fault) {
        // What is wrong from the beginning is no incident of a drive.
        if !fault.is_over && self.was_localised() {
            self.has_failed.store(true, Ordering::Relaxed);
        }
        let _ = self.faults.0.send(fault);
    }

    /// Whether the bus was told of a fault since the last call, once the vehicle has known where it is.
    pub fn has_failed(&self) -> bool {
        self.has_failed.swap(false, Ordering::Relaxed)
    }

    /// The next fault, or end of one, that the bus was told of.
    pub fn next_fault(&self) -> Option<Fault> {
        self.faults.1.receive()
    }

    /// Leaves what was published to the log and to other programs; without room it is left out.
    pub fn published(&self, published: &SentPose) {
        let _ = self.published.send(*published);
        let _ = self.poses.send(published.pose);
        *self.pose.lock() = Some(published.pose);
        if published.pose.mode.is_localised() {
            self.was_localised.store(true, Ordering::Relaxed);
        }
    }

    /// The pose that was published last.
    pub fn pose(&self) -> Option<PoseOutput> {
        *self.pose.lock()
    }

    /// Whether a pose that rests on what was seen was ever published.
    pub fn was_localised(&self) -> bool {
        self.was_localised.load(Ordering::Relaxed)
    }

    /// The localiser has said something.
    pub fn publish(&self, estimate: Estimate) {
        *self.estimate.lock() = Some(estimate);
    }

    /// What the localiser has said since the last call.
    pub fn newest_estimate(&self) -> Option<Estimate> {
        self.estimate.lock().take()
    }

    /// What is known of the laser.
    pub fn set_laser(&self, watch: SensorWatch) {
        *self.laser.lock() = watch;
    }

    /// Whether the laser can be used.
    pub fn laser_health(&self) -> LaserHealth {
        self.laser.lock().health(self.now())
    }

    /// How fast the laser moves.
    pub fn set_laser_speed(&self, speed: SensorSpeed) {
        *self.laser_speed.lock() = Some(speed);
    }

    /// How fast the laser moves, by what the bus has said since the last call.
    pub fn newest_laser_speed(&self) -> Option<SensorSpeed> {
        self.laser_speed.lock().take()
    }

    /// How the bus is.
    pub fn set_bus(&self, state: BusState) {
        *self.bus.lock() = state;
    }

    /// How the bus is.
    pub fn bus(&self) -> BusState {
        *self.bus.lock()
    }

    /// Whether the vehicle stands.
    pub fn set_standing(&self, is_standing: bool) {
        self.is_standing.store(is_standing, Ordering::Relaxed);
    }

    /// Whether the vehicle stands: its wheel has not moved for a second, or it has no encoders that were ever heard.
    pub fn is_standing(&self) -> bool {
        self.is_standing.load(Ordering::Relaxed)
    }

    /// Leaves it to another thread to store the settings, and how the controller speaks on the bus. False if that has too much to store
    /// already.
    pub fn save(&self, parameters: CommunicationParameters) -> bool {
        self.saves.0.send(parameters).is_ok()
    }

    /// Waits until somebody on the bus wants the settings stored, but no longer than that.
    pub fn wait_for_save(&self, patience: Duration) -> Option<CommunicationParameters> {
        self.saves.1.wait(Instant::now() + patience).ok().flatten()
    }

    /// What was wanted is stored, or could not be.
    pub fn tell_saved(&self, is_stored: bool) {
        *self.saved.lock() = Some(is_stored);
    }

    /// Whether what was wanted is stored, once that is known.
    pub fn saved(&self) -> Option<bool> {
        self.saved.lock().take()
    }

    /// The machine's own gyro has told a rate. If there is no room for it, it is lost and counted.
    pub fn pass_gyro(&self, sample: GyroSample) {
        if self.readings.0.send(sample).is_err() {
            self.lost_events.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// The next rate that it has told.
    pub fn next_gyro(&self) -> Option<GyroSample> {
        self.readings.1.receive()
    }

    /// What wires are to say.
    pub fn set_discrete_report(&self, report: DiscreteReport) {
        *self.discrete_report.lock() = Some(report);
    }

    /// What wires are to say. None before the bus has begun.
    pub fn discrete_report(&self) -> Option<DiscreteReport> {
        *self.discrete_report.lock()
    }

    /// What wires say. A reset and a line that has failed stay until the bus has heard of them.
    pub fn set_discrete_inputs(&self, inputs: DiscreteInputs) {
        let mut waiting = self.discrete_inputs.lock();
        let before = waiting.unwrap_or_default();
        *waiting = Some(DiscreteInputs {
            is_reset: inputs.is_reset || before.is_reset,
            failed: inputs.failed | before.failed,
            ..inputs
        });
    }

    /// What wires have said since the last call.
    pub fn newest_discrete_inputs(&self) -> Option<DiscreteInputs> {
        self.discrete_inputs.lock().take()
    }

    /// A thread has run.
    pub fn check_in(&self, task: Task) {
        self.seen.fetch_or(task as u32, Ordering::Relaxed);
    }

    /// Whether all threads have run since the last time that they all had; if so, none has from now on.
    pub fn have_all_run(&self) -> bool {
        self.seen.compare_exchange(self.wanted, 0, Ordering::Relaxed, Ordering::Relaxed).is_ok()
    }
}
