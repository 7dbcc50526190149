//! What the tasks of different priorities pass to each other.

use core::cell::Cell;

use agv_controller::{Estimate, SentPose, Told};
use agv_core::measurement::{GyroSample, Time};
use agv_core::state::LaserHealth;
use agv_wire::can::controller_node::CommunicationParameters;
use agv_wire::nav350::{Revolution, SensorSpeed, SensorWatch};
use critical_section::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;
use embassy_sync::zerocopy_channel;
use embassy_time::Timer;
use portable_atomic::{AtomicBool, AtomicU32, Ordering};

/// Events that wait for the localiser: more than half a second of samples, or a third of one beside those of a gyro.
pub const EVENTS: usize = 64;

/// Events of the bus, in order.
pub static BUS_EVENTS: Channel<CriticalSectionRawMutex, Told, EVENTS> = Channel::new();

/// Published poses that wait for the log. Of a revolution that takes the localiser longer than this, some are left out.
const PUBLISHED_POSES: usize = 5;

/// What the bus has published, for the log.
static PUBLISHED: Channel<CriticalSectionRawMutex, SentPose, PUBLISHED_POSES> = Channel::new();

/// Readings of the board's own gyro that wait for the bus, which looks every millisecond.
static READINGS: Channel<CriticalSectionRawMutex, GyroSample, 4> = Channel::new();

/// The end of the revolutions' channel at the laser, and that at the localiser.
pub type RevolutionSender = zerocopy_channel::Sender<'static, CriticalSectionRawMutex, Revolution>;
/// The end of the revolutions' channel at the localiser.
pub type RevolutionReceiver = zerocopy_channel::Receiver<'static, CriticalSectionRawMutex, Revolution>;

/// What the localiser has said last; the bus takes it before it says anything.
static ESTIMATE: Signal<CriticalSectionRawMutex, Estimate> = Signal::new();

static LASER: Mutex<Cell<SensorWatch>> = Mutex::new(Cell::new(SensorWatch::new()));
/// How fast the laser moves, if it is told so.
static LASER_SPEED: Signal<CriticalSectionRawMutex, SensorSpeed> = Signal::new();
/// Somebody on the bus wants the settings stored, and these of how the controller speaks there.
static SAVE: Signal<CriticalSectionRawMutex, CommunicationParameters> = Signal::new();
/// Whether that was done.
static SAVED: Signal<CriticalSectionRawMutex, bool> = Signal::new();
static IS_PAUSE_ANNOUNCED: AtomicBool = AtomicBool::new(false);
/// A page of flash is being erased, or is about to be: whoever reads the same bank stands still for as long.
static IS_ERASING: AtomicBool = AtomicBool::new(false);
/// The localiser may read a map that lies in flash.
static READS_FLASH: AtomicBool = AtomicBool::new(false);
static HAS_BUS_STARTED: AtomicBool = AtomicBool::new(false);
static IS_STANDING: AtomicBool = AtomicBool::new(true);
static ARE_SETTINGS_SOUND: AtomicBool = AtomicBool::new(true);
/// Events that the localiser was too slow for.
static LOST_EVENTS: AtomicU32 = AtomicU32::new(0);

/// Leaves an event to the localiser. If it is so far behind that there is no room, the event is lost and counted.
pub fn pass_on(told: Told) {
    if BUS_EVENTS.try_send(told).is_err() {
        LOST_EVENTS.fetch_add(1, Ordering::Relaxed);
    }
}

/// How many events the localiser was too slow for.
#[must_use]
pub fn lost_events() -> u32 {
    LOST_EVENTS.load(Ordering::Relaxed)
}

/// Leaves what was published to the log; without room it is left out, as records are that the network is too slow for.
pub fn log_published(published: SentPose) {
    let _ = PUBLISHED.try_send(published);
}

/// The next pose that was published before the bus told more than so many events.
#[must_use]
pub fn published_until(told: u32) -> Option<SentPose> {
    let next = PUBLISHED.try_peek().ok()?;
    // The count wraps: what is ahead by less than half of its range is later.
    if next.progress.told.wrapping_sub(told) as i32 > 0 { None } else { PUBLISHED.try_receive().ok() }
}

/// The board's own gyro has told a rate. If there is no room for it, it is lost and counted.
pub fn pass_gyro(sample: GyroSample) {
    if READINGS.try_send(sample).is_err() {
        LOST_EVENTS.fetch_add(1, Ordering::Relaxed);
    }
}

/// The next rate of the board's own gyro.
#[must_use]
pub fn next_gyro() -> Option<GyroSample> {
    READINGS.try_receive().ok()
}

/// The localiser has said something.
pub fn publish(estimate: Estimate) {
    ESTIMATE.signal(estimate);
}

/// What the localiser has said since the last call.
#[must_use]
pub fn newest_estimate() -> Option<Estimate> {
    ESTIMATE.try_take()
}

/// What is known of the laser.
pub fn set_laser(watch: SensorWatch) {
    critical_section::with(|section| LASER.borrow(section).set(watch));
}

/// How fast the laser moves.
pub fn set_laser_speed(speed: SensorSpeed) {
    LASER_SPEED.signal(speed);
}

/// How fast the laser moves, by what the bus has said since the last call.
#[must_use]
pub fn newest_laser_speed() -> Option<SensorSpeed> {
    LASER_SPEED.try_take()
}

/// Whether the laser can be used.
#[must_use]
pub fn laser_health() -> LaserHealth {
    critical_section::with(|section| LASER.borrow(section).get()).health(now())
}

/// Whether the vehicle stands.
pub fn set_standing(is_standing: bool) {
    IS_STANDING.store(is_standing, Ordering::Relaxed);
}

/// Whether the vehicle stands: its wheel has not moved for a second, or it has no encoders that were ever heard.
#[must_use]
pub fn is_standing() -> bool {
    IS_STANDING.load(Ordering::Relaxed)
}

/// Whether everything that was set was found in flash.
pub fn set_settings_sound(are_sound: bool) {
    ARE_SETTINGS_SOUND.store(are_sound, Ordering::Relaxed);
}

/// Whether everything that was set was found in flash.
#[must_use]
pub fn are_settings_sound() -> bool {
    ARE_SETTINGS_SOUND.load(Ordering::Relaxed)
}

/// Leaves it to the network's executor to store the settings, and how the controller speaks on the bus.
pub fn save(parameters: CommunicationParameters) {
    SAVE.signal(parameters);
}

/// Waits until somebody on the bus wants the settings stored, and that.
pub async fn save_wanted() -> CommunicationParameters {
    SAVE.wait().await
}

/// What was wanted is stored, or could not be.
pub fn tell_saved(is_stored: bool) {
    SAVED.signal(is_stored);
}

/// Whether what was wanted is stored, once that is known.
#[must_use]
pub fn saved() -> Option<bool> {
    SAVED.try_take()
}

/// The tasks of the bus run: from now on it is told of a pause.
pub fn bus_has_started() {
    HAS_BUS_STARTED.store(true, Ordering::Relaxed);
}

/// The processor is about to stand still: waits for so long, us, that the bus is told before, if it has started.
pub async fn announce_pause(time: u64) {
    if !HAS_BUS_STARTED.load(Ordering::Relaxed) {
        return;
    }
    IS_PAUSE_ANNOUNCED.store(true, Ordering::Relaxed);
    Timer::after_micros(time).await;
}

/// Whether a pause was announced, since the last call.
#[must_use]
pub fn is_pause_announced() -> bool {
    IS_PAUSE_ANNOUNCED.swap(false, Ordering::Relaxed)
}

/// Waits until the localiser does not read flash, and keeps it from that until [`end_erasing`].
pub async fn begin_erasing() {
    IS_ERASING.store(true, Ordering::SeqCst);
    while READS_FLASH.load(Ordering::SeqCst) {
        Timer::after_millis(1).await;
    }
}

/// The localiser may read flash again.
pub fn end_erasing() {
    IS_ERASING.store(false, Ordering::SeqCst);
}

/// The localiser is about to read flash; false if it has to wait.
#[must_use]
pub fn begin_to_read_flash() -> bool {
    // What erases interrupts this at any place: one of both sees what the other has said.
    READS_FLASH.store(true, Ordering::SeqCst);
    let may_read = !IS_ERASING.load(Ordering::SeqCst);
    READS_FLASH.store(may_read, Ordering::SeqCst);
    may_read
}

/// The localiser has read flash.
pub fn end_to_read_flash() {
    READS_FLASH.store(false, Ordering::SeqCst);
}

/// The time of the firmware.
#[must_use]
pub fn now() -> Time {
    Time::from_micros(embassy_time::Instant::now().as_micros())
}
