//! What the tasks of different priorities pass to each other.

use core::cell::RefCell;

use agv_core::localizer::{OutputPredictor, PoseFix};
use agv_core::measurement::{EncoderFaults, EncoderSample, Time};
use agv_core::state::PoseOutput;
use agv_core::wire::can::controller::LaserHealth;
use agv_core::wire::nav350::Revolution;
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

/// What the bus publishes.
pub struct Published {
    predictor: Option<OutputPredictor>,
    laser: LaserHealth,
    /// Events that the localiser was too slow for.
    lost_events: u32,
}

static PUBLISHED: Mutex<RefCell<Published>> =
    Mutex::new(RefCell::new(Published { predictor: None, laser: LaserHealth::Unknown, lost_events: 0 }));

fn with<T>(work: impl FnOnce(&mut Published) -> T) -> T {
    critical_section::with(|section| work(&mut PUBLISHED.borrow(section).borrow_mut()))
}

/// Begins to publish.
pub fn start(predictor: OutputPredictor) {
    with(|published| published.predictor = Some(predictor));
}

/// Takes a sample at once, and leaves it to the localiser.
pub fn take_encoders(sample: EncoderSample) {
    with(|published| {
        if let Some(predictor) = &mut published.predictor {
            predictor.encoders(&sample);
        }
    });
    pass_on(BusEvent::Encoders(sample));
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

/// The localiser has said something.
pub fn update(output: &PoseOutput) {
    with(|published| {
        if let Some(predictor) = &mut published.predictor {
            predictor.update(output);
        }
    });
}

/// Whether the laser can be used.
pub fn set_laser(health: LaserHealth) {
    with(|published| published.laser = health);
}

/// The pose for now, and the laser's health.
#[must_use]
pub fn output() -> (Option<PoseOutput>, LaserHealth) {
    with(|published| (published.predictor.as_ref().and_then(OutputPredictor::output), published.laser))
}

/// The time of the firmware.
#[must_use]
pub fn now() -> Time {
    Time::from_micros(embassy_time::Instant::now().as_micros())
}
