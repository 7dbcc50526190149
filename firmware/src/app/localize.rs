//! The localiser's loop, below all interrupts.

use agv_core::localizer::{Capacities, Event, Localizer};

use super::exchange::{self, BUS_EVENTS, RevolutionReceiver};
use super::log_stream::LogWriter;
use super::supervision::{self, Task};

/// What handles events.
pub struct Localization<C: Capacities + 'static> {
    /// The localiser, and what searches its pose when it has none.
    pub localization: agv_controller::Localization<&'static mut Localizer<C>>,
    /// Where events and outputs are written.
    pub log: LogWriter,
    /// Whether it has a map that lies in the flash that settings are written to.
    pub reads_flash: bool,
}

impl<C: Capacities> Localization<C> {
    /// Handles what has come, and returns whether there was anything.
    ///
    /// Samples that wait go first: they are what a revolution is seen from. A revolution takes up to 10 ms at 480 MHz; what
    /// comes meanwhile waits, and the bus publishes without it. A search takes what time is left.
    pub fn step(&mut self, revolutions: &mut RevolutionReceiver) -> bool {
        supervision::check_in(Task::Localizer);
        self.log_published(self.localization.told());
        if self.take_bus_event() {
            return true;
        }
        // While a page is erased, revolutions and the search wait, and the pose goes on: the vehicle stands.
        if self.reads_flash && !exchange::begin_to_read_flash() {
            return false;
        }
        let is_busy = self.look(revolutions);
        exchange::end_to_read_flash();
        is_busy
    }

    /// Handles a revolution, or goes on with the search, and returns whether there was anything.
    fn look(&mut self, revolutions: &mut RevolutionReceiver) -> bool {
        let Some(revolution) = revolutions.try_receive() else {
            return self.search();
        };
        let Self { localization, log, .. } = self;
        localization.revolution(revolution, |record| log.write(record));
        exchange::publish(localization.estimate());
        revolutions.receive_done();
        true
    }

    /// Handles what the bus has told, and returns whether there was anything.
    pub fn take_bus_event(&mut self) -> bool {
        let Ok(told) = BUS_EVENTS.try_receive() else { return false };
        if let Some(progress) = told.progress {
            self.log_published(progress.told.wrapping_sub(1));
        }
        let Self { localization, log, .. } = self;
        localization.hear(&told, |record| log.write(record));
        exchange::publish(localization.estimate());
        true
    }

    /// Logs what was published before the bus told more than so many events.
    fn log_published(&mut self, told: u32) {
        let Self { localization, log, .. } = self;
        while let Some(published) = exchange::published_until(told) {
            localization.published(&published, |record| log.write(record));
        }
    }

    /// Tells the localiser something, publishes what it says, and logs both.
    pub fn handle(&mut self, event: &Event) {
        let Self { localization, log, .. } = self;
        localization.handle(event, |record| log.write(record));
        exchange::publish(localization.estimate());
    }

    /// Goes on with the search for a pose.
    fn search(&mut self) -> bool {
        let Self { localization, log, .. } = self;
        let before = localization.relocalization();
        let mut has_spoken = false;
        let is_busy = localization.search(|record| {
            has_spoken = true;
            log.write(record);
        });
        if has_spoken || localization.relocalization() != before {
            exchange::publish(localization.estimate());
        }
        is_busy
    }
}
