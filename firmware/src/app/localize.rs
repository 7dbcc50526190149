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
    if let Ok(event) = BUS_EVENTS.try_receive() {
        let event = match event {
            BusEvent::Encoders(sample) => Event::Encoders(sample),
            BusEvent::EncoderFaults(faults) => Event::EncoderFaults(faults),
            BusEvent::SetPose(fix) => Event::SetPose(fix),
        };
        handle(localizer, &event, log);
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

fn handle(localizer: &mut Localizer, event: &Event, log: &mut LogWriter) {
    log.write(&Record::Event(*event));
    let outputs = localizer.handle(event);
    exchange::update(&outputs.pose);
    log.write(&Record::Output(Output::from(outputs)));
}
