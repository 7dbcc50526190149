//! The localiser's loop, below all interrupts.

use agv_core::localizer::{Event, StartSearch};
use agv_core::record::{Output, Record};

use super::exchange::{self, BUS_EVENTS, BusEvent, RevolutionReceiver};
use super::log_stream::LogWriter;
use super::room::Localizer;
use super::supervision::{self, Task};

/// What handles events.
pub struct Localization {
    /// The localiser.
    pub localizer: &'static mut Localizer,
    /// What searches its pose when it has none.
    pub search: &'static mut StartSearch,
    /// Where events and outputs are written.
    pub log: LogWriter,
}

impl Localization {
    /// Handles what has come, and returns whether there was anything.
    ///
    /// Samples that wait go first: they are what a revolution is seen from. A revolution takes up to 10 ms at 480 MHz; what
    /// comes meanwhile waits, and the predictor publishes without it. A search takes what time is left.
    pub fn step(&mut self, revolutions: &mut RevolutionReceiver) -> bool {
        supervision::check_in(Task::Localizer);
        if self.take_bus_event() {
            return true;
        }
        let Some(revolution) = revolutions.try_receive() else {
            return self.search();
        };
        if let Some(reflectors) = revolution.reflectors() {
            self.handle(&Event::Reflectors(reflectors));
        }
        if let Some(scan) = revolution.scan() {
            self.handle(&Event::Scan(scan));
        }
        revolutions.receive_done();
        true
    }

    /// Handles what the bus has told, and returns whether there was anything.
    pub fn take_bus_event(&mut self) -> bool {
        let Ok(event) = BUS_EVENTS.try_receive() else { return false };
        self.handle(&match event {
            BusEvent::Encoders(sample) => Event::Encoders(sample),
            BusEvent::EncoderFaults(faults) => Event::EncoderFaults(faults),
            BusEvent::SetPose(fix) => Event::SetPose(fix),
        });
        true
    }

    /// Tells the localiser something, publishes what it says, and logs both.
    pub fn handle(&mut self, event: &Event) {
        self.log.write(&Record::Event(*event));
        self.localizer.handle(event);
        let outputs = self.localizer.outputs();
        exchange::update(&outputs.pose, &self.localizer.odometry_bias());
        self.log.write(&Record::Output(Output::from(outputs)));
        let mode = outputs.pose.mode;
        self.search.handle(event, mode, self.localizer.reflectors());
    }

    /// Goes on with the search for a pose. A pose that is found is an event like any other, so that a replay of the log
    /// needs no search.
    fn search(&mut self) -> bool {
        let (is_busy, found) = self.search.advance(self.localizer.reflectors());
        if let Some(fix) = found {
            self.handle(&Event::SetPose(fix));
        }
        exchange::set_start_search(self.search.state());
        is_busy
    }
}
