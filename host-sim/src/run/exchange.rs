//! What the threads pass to each other. Whoever has a deadline waits for nobody: queues are bounded, and what does not fit is
//! counted and left out; locks are held for the time of a copy.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread::Thread;
use std::time::Duration;

use agv_controller::{DiscreteInputs, DiscreteReport, Estimate, SentPose, Told};
use agv_core::measurement::{GyroSample, Time};
use agv_core::state::{LaserHealth, PoseOutput};
use agv_wire::can::controller_node::CommunicationParameters;
use agv_wire::nav350::{Revolution, SensorSpeed, SensorWatch};

use super::fault::Fault;
use super::periods::Periods;
use crate::link::clock::Clock;

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
    pub free_revolutions: SyncSender<Box<Revolution>>,
}

/// The ends of the queues at the laser.
pub(super) struct LaserQueues {
    pub revolutions: SyncSender<Box<Revolution>>,
    pub free_revolutions: Receiver<Box<Revolution>>,
}

impl LaserQueues {
    /// Leaves a revolution to the localiser. If it is so far behind that there is no room, the revolution is lost and counted.
    pub fn pass_on(&self, revolution: &Revolution, exchange: &Exchange) {
        let Ok(mut room) = self.free_revolutions.try_recv() else { return exchange.lose_revolution() };
        Revolution::clone_from(&mut room, revolution);
        // There are no more of them than there is room for.
        let _ = self.revolutions.try_send(room);
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
    events: SyncSender<Told>,
    published: SyncSender<SentPose>,
    poses: SyncSender<PoseOutput>,
    faults: (SyncSender<Fault>, Mutex<Receiver<Fault>>),
    readings: (SyncSender<GyroSample>, Mutex<Receiver<GyroSample>>),
    has_failed: AtomicBool,
    localizer: OnceLock<Thread>,
    estimate: Mutex<Option<Estimate>>,
    laser: Mutex<SensorWatch>,
    laser_speed: Mutex<Option<SensorSpeed>>,
    save: Mutex<Option<CommunicationParameters>>,
    save_wanted: Condvar,
    saved: Mutex<Option<bool>>,
    pose: Mutex<Option<PoseOutput>>,
    bus: Mutex<BusState>,
    is_standing: AtomicBool,
    was_localised: AtomicBool,
    lost_events: AtomicU32,
    lost_revolutions: AtomicU32,
    lost_records: AtomicU32,
    discrete_report: Mutex<Option<DiscreteReport>>,
    discrete_inputs: Mutex<Option<DiscreteInputs>>,
    seen: AtomicU32,
    /// Tasks that must run.
    wanted: u32,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Exchange {
    /// An exchange where nothing was said, and the other ends of its queues, of a controller that has these tasks besides.
    pub fn new(clock: Clock, is_stopped: Arc<AtomicBool>, besides: &[Task]) -> (Self, Queues) {
        let (events, events_end) = sync_channel(EVENTS);
        let (published, published_end) = sync_channel(PUBLISHED_POSES);
        let (poses, poses_end) = sync_channel(POSES);
        let (revolutions, revolutions_end) = sync_channel(REVOLUTIONS);
        let (faults, faults_end) = sync_channel(FAULTS);
        let (readings, readings_end) = sync_channel(READINGS);
        let (free_revolutions, free_revolutions_end) = sync_channel(REVOLUTIONS);
        for _ in 0..REVOLUTIONS {
            // There is room for all.
            let _ = free_revolutions.try_send(Box::default());
        }
        let exchange = Self {
            clock,
            periods: Periods::default(),
            is_stopped,
            is_restart_wanted: AtomicBool::new(false),
            events,
            published,
            poses,
            faults: (faults, Mutex::new(faults_end)),
            readings: (readings, Mutex::new(readings_end)),
            has_failed: AtomicBool::new(false),
            localizer: OnceLock::new(),
            estimate: Mutex::new(None),
            laser: Mutex::new(SensorWatch::new()),
            laser_speed: Mutex::new(None),
            save: Mutex::new(None),
            save_wanted: Condvar::new(),
            saved: Mutex::new(None),
            pose: Mutex::new(None),
            bus: Mutex::new(BusState::Lost),
            is_standing: AtomicBool::new(true),
            was_localised: AtomicBool::new(false),
            lost_events: AtomicU32::new(0),
            lost_revolutions: AtomicU32::new(0),
            lost_records: AtomicU32::new(0),
            discrete_report: Mutex::new(None),
            discrete_inputs: Mutex::new(None),
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
        if self.events.try_send(told).is_err() {
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
        let _ = self.faults.0.try_send(fault);
    }

    /// Whether the bus was told of a fault since the last call, once the vehicle has known where it is.
    pub fn has_failed(&self) -> bool {
        self.has_failed.swap(false, Ordering::Relaxed)
    }

    /// The next fault, or end of one, that the bus was told of.
    pub fn next_fault(&self) -> Option<Fault> {
        locked(&self.faults.1).try_recv().ok()
    }

    /// Leaves what was published to the log and to other programs; without room it is left out.
    pub fn published(&self, published: &SentPose) {
        let _ = self.published.try_send(*published);
        let _ = self.poses.try_send(published.pose);
        *locked(&self.pose) = Some(published.pose);
        if published.pose.mode.is_localised() {
            self.was_localised.store(true, Ordering::Relaxed);
        }
    }

    /// The pose that was published last.
    pub fn pose(&self) -> Option<PoseOutput> {
        *locked(&self.pose)
    }

    /// Whether a pose that rests on what was seen was ever published.
    pub fn was_localised(&self) -> bool {
        self.was_localised.load(Ordering::Relaxed)
    }

    /// The localiser has said something.
    pub fn publish(&self, estimate: Estimate) {
        *locked(&self.estimate) = Some(estimate);
    }

    /// What the localiser has said since the last call.
    pub fn newest_estimate(&self) -> Option<Estimate> {
        locked(&self.estimate).take()
    }

    /// What is known of the laser.
    pub fn set_laser(&self, watch: SensorWatch) {
        *locked(&self.laser) = watch;
    }

    /// Whether the laser can be used.
    pub fn laser_health(&self) -> LaserHealth {
        locked(&self.laser).health(self.now())
    }

    /// How fast the laser moves.
    pub fn set_laser_speed(&self, speed: SensorSpeed) {
        *locked(&self.laser_speed) = Some(speed);
    }

    /// How fast the laser moves, by what the bus has said since the last call.
    pub fn newest_laser_speed(&self) -> Option<SensorSpeed> {
        locked(&self.laser_speed).take()
    }

    /// How the bus is.
    pub fn set_bus(&self, state: BusState) {
        *locked(&self.bus) = state;
    }

    /// How the bus is.
    pub fn bus(&self) -> BusState {
        *locked(&self.bus)
    }

    /// Whether the vehicle stands.
    pub fn set_standing(&self, is_standing: bool) {
        self.is_standing.store(is_standing, Ordering::Relaxed);
    }

    /// Whether the vehicle stands: its wheel has not moved for a second, or it has no encoders that were ever heard.
    pub fn is_standing(&self) -> bool {
        self.is_standing.load(Ordering::Relaxed)
    }

    /// Leaves it to another thread to store the settings, and how the controller speaks on the bus.
    pub fn save(&self, parameters: CommunicationParameters) {
        *locked(&self.save) = Some(parameters);
        self.save_wanted.notify_one();
    }

    /// Waits until somebody on the bus wants the settings stored, but no longer than that.
    pub fn wait_for_save(&self, patience: Duration) -> Option<CommunicationParameters> {
        let guard = locked(&self.save);
        let waited = self.save_wanted.wait_timeout_while(guard, patience, |save| save.is_none());
        let (mut guard, _) = waited.unwrap_or_else(PoisonError::into_inner);
        guard.take()
    }

    /// What was wanted is stored, or could not be.
    pub fn tell_saved(&self, is_stored: bool) {
        *locked(&self.saved) = Some(is_stored);
    }

    /// Whether what was wanted is stored, once that is known.
    pub fn saved(&self) -> Option<bool> {
        locked(&self.saved).take()
    }

    /// The machine's own gyro has told a rate. If there is no room for it, it is lost and counted.
    pub fn pass_gyro(&self, sample: GyroSample) {
        if self.readings.0.try_send(sample).is_err() {
            self.lost_events.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// The next rate that it has told.
    pub fn next_gyro(&self) -> Option<GyroSample> {
        locked(&self.readings.1).try_recv().ok()
    }

    /// What wires are to say.
    pub fn set_discrete_report(&self, report: DiscreteReport) {
        *locked(&self.discrete_report) = Some(report);
    }

    /// What wires are to say. None before the bus has begun.
    pub fn discrete_report(&self) -> Option<DiscreteReport> {
        *locked(&self.discrete_report)
    }

    /// What wires say. A reset and a line that has failed stay until the bus has heard of them.
    pub fn set_discrete_inputs(&self, inputs: DiscreteInputs) {
        let mut waiting = locked(&self.discrete_inputs);
        let before = waiting.unwrap_or_default();
        *waiting = Some(DiscreteInputs {
            is_reset: inputs.is_reset || before.is_reset,
            failed: inputs.failed | before.failed,
            ..inputs
        });
    }

    /// What wires have said since the last call.
    pub fn newest_discrete_inputs(&self) -> Option<DiscreteInputs> {
        locked(&self.discrete_inputs).take()
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
