//! What the tasks of different priorities pass to each other.

use core::cell::RefCell;

use agv_core::localizer::{OutputPredictor, PoseFix};
use agv_core::measurement::{EncoderFaults, EncoderSample, Time};
use agv_core::odometry::OdometryBias;
use agv_core::state::PoseOutput;
use agv_core::wire::can::controller::{LaserHealth, StartSearch};
use agv_core::wire::nav350::{LostReason, Report, Revolution, SensorWatch};
use critical_section::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::zerocopy_channel;

/// What the bus tells the localiser.
#[derive(Clone, Copy, Debug)]
pub enum BusEvent {
    /// Counters of both encoders.
    Encoders(EncoderSample),
    /// What is wrong with them.
    EncoderFaults(EncoderFaults),
    /// A pose from outside.
    SetPose(PoseFix),
}

/// Events that wait for the localiser: more than half a second of samples.
pub const EVENTS: usize = 64;

/// Events of the bus, in order.
pub static BUS_EVENTS: Channel<CriticalSectionRawMutex, BusEvent, EVENTS> = Channel::new();

/// The end of the revolutions' channel at the laser, and that at the localiser.
pub type RevolutionSender = zerocopy_channel::Sender<'static, CriticalSectionRawMutex, Revolution>;
/// The end of the revolutions' channel at the localiser.
pub type RevolutionReceiver = zerocopy_channel::Receiver<'static, CriticalSectionRawMutex, Revolution>;

/// What the bus publishes, and what others want to know of it.
struct Published {
    predictor: Option<OutputPredictor<MOTIONS>>,
    laser: SensorWatch,
    /// The first sample at about this place of the driving wheel, and the last one.
    stand: Option<(EncoderSample, Time)>,
    /// Events that the localiser was too slow for.
    lost_events: u32,
    are_settings_sound: bool,
    start_search: StartSearch,
    latest_prediction: u32,
}

static PUBLISHED: Mutex<RefCell<Published>> = Mutex::new(RefCell::new(Published {
    predictor: None,
    laser: SensorWatch::new(),
    stand: None,
    lost_events: 0,
    are_settings_sound: true,
    start_search: StartSearch::Idle,
    latest_prediction: 0,
}));

/// Motions that the localiser may be behind: more than a scan takes. All of them are redone while no interrupt comes,
/// which with 16 of them is 0.1 ms at 480 MHz; the bus's queue holds three frames, 0.3 ms.
const MOTIONS: usize = 16;
/// A vehicle whose wheel has not moved for so long stands, s.
const STANDSTILL: f64 = 1.0;
/// By how much the counter of a wheel that stands may be off, ticks.
const TREMBLE: u32 = 3;

fn with<T>(work: impl FnOnce(&mut Published) -> T) -> T {
    critical_section::with(|section| work(&mut PUBLISHED.borrow(section).borrow_mut()))
}

/// Begins to publish.
pub fn start(predictor: OutputPredictor<MOTIONS>) {
    with(|published| published.predictor = Some(predictor));
}

/// Takes a sample at once, and leaves it to the localiser.
pub fn take_encoders(sample: EncoderSample) {
    with(|published| {
        if let Some(predictor) = &mut published.predictor {
            predictor.encoders(&sample);
        }
        let place = published.stand.map(|(first, _)| first);
        let stands = place.filter(|first| {
            let way = sample.drive.wrapping_sub(first.drive);
            way.min(way.wrapping_neg()) <= TREMBLE
        });
        published.stand = Some((stands.unwrap_or(sample), sample.time));
        let delay = now().micros().saturating_sub(sample.time.micros());
        published.latest_prediction = published.latest_prediction.max(u32::try_from(delay).unwrap_or(u32::MAX));
    });
    pass_on(BusEvent::Encoders(sample));
}

/// Longest time from the frame that made a sample whole to its prediction, us.
#[must_use]
pub fn latest_prediction() -> u32 {
    with(|published| published.latest_prediction)
}

/// Whether the vehicle stands: its wheel has not moved for a second, or it has no encoders that were ever heard.
#[must_use]
pub fn is_standing() -> bool {
    with(|published| {
        published
            .stand
            .is_none_or(|(first, last)| last.since(first.time) >= STANDSTILL && now().since(last) < STANDSTILL)
    })
}

/// Takes what is wrong with the encoders at once, and leaves it to the localiser.
pub fn take_faults(faults: EncoderFaults) {
    with(|published| {
        if let Some(predictor) = &mut published.predictor {
            predictor.doubt_encoders(&faults);
        }
    });
    pass_on(BusEvent::EncoderFaults(faults));
}

/// Leaves an event to the localiser. If it is so far behind that there is no room, the event is lost and counted.
pub fn pass_on(event: BusEvent) {
    if BUS_EVENTS.try_send(event).is_err() {
        with(|published| published.lost_events += 1);
    }
}

/// The localiser has said something, and what it has learnt of the odometry.
pub fn update(output: &PoseOutput, bias: &OdometryBias) {
    with(|published| {
        if let Some(predictor) = &mut published.predictor {
            predictor.update(output, bias);
        }
    });
}

/// The laser has measured a revolution.
pub fn laser_has_measured() {
    with(|published| published.laser.measured(now()));
}

/// How far the search for a pose has come.
pub fn set_start_search(state: StartSearch) {
    with(|published| published.start_search = state);
}

/// How far the search for a pose has come.
#[must_use]
pub fn start_search() -> StartSearch {
    with(|published| published.start_search)
}

/// The laser cannot be reached.
pub fn laser_is_unreachable() {
    with(|published| published.laser.unreachable());
}

/// The session has given the connection to the laser up.
pub fn laser_was_lost(reason: LostReason) {
    with(|published| published.laser.lost(reason));
}

/// The session with the laser has reported something.
pub fn laser_has_reported(report: Report) {
    with(|published| published.laser.reported(report));
}

/// Whether everything that was set was found in flash.
pub fn set_settings_sound(are_sound: bool) {
    with(|published| published.are_settings_sound = are_sound);
}

/// Whether everything that was set was found in flash.
#[must_use]
pub fn are_settings_sound() -> bool {
    with(|published| published.are_settings_sound)
}

/// How many events the localiser was too slow for.
#[must_use]
pub fn lost_events() -> u32 {
    with(|published| published.lost_events)
}

/// The pose for now, and the laser's health.
#[must_use]
pub fn output() -> (Option<PoseOutput>, LaserHealth) {
    with(|published| (published.predictor.as_ref().and_then(OutputPredictor::output), published.laser.health(now())))
}

/// The time of the firmware.
#[must_use]
pub fn now() -> Time {
    Time::from_micros(embassy_time::Instant::now().as_micros())
}
