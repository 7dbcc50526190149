//! The localiser's loop, below all interrupts.

use agv_core::localizer::{Event, Localizer};
use agv_core::record::{Output, Record};

use super::exchange::{self, BUS_EVENTS, BusEvent, RevolutionReceiver};
use super::log_stream::LogWriter;
use super::supervision::{self, Task};

/// Handles what has come, and returns whether there was anything.
///
/// Samples that wait go first: they are what a revolution is seen from. A revolution takes up to 10 ms at 480 MHz; what
/// comes meanwhile waits, and the predictor publishes without it.
pub fn step(localizer: &mut Localizer, revolutions: &mut RevolutionReceiver, log: &mut LogWriter) -> bool {
    supervision::check_in(Task::Localizer);
    if take_bus_event(localizer, log) {
        return true;
    }
    let Some(revolution) = revolutions.try_receive() else {
        return false;
    };
    if let Some(reflectors) = revolution.reflectors() {
        handle(localizer, &Event::Reflectors(reflectors), log);
    }
    if let Some(scan) = revolution.scan() {
        handle(localizer, &Event::Scan(scan), log);
    }
    revolutions.receive_done();
    true
}

/// Handles what the bus has told, and returns whether there was anything.
pub fn take_bus_event(localizer: &mut Localizer, log: &mut LogWriter) -> bool {
    let Ok(event) = BUS_EVENTS.try_receive() else { return false };
    let event = match event {
        BusEvent::Encoders(sample) => Event::Encoders(sample),
        BusEvent::EncoderFaults(faults) => Event::EncoderFaults(faults),
        BusEvent::SetPose(fix) => Event::SetPose(fix),
    };
    handle(localizer, &event, log);
    true
}

/// Tells the localiser something, publishes what it says, and logs both.
pub fn handle(localizer: &mut Localizer, event: &Event, log: &mut LogWriter) {
    log.write(&Record::Event(*event));
    let outputs = localizer.handle(event);
    exchange::update(&outputs.pose);
    log.write(&Record::Output(Output::from(outputs)));
}
