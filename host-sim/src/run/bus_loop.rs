//! The CAN bus: encoders in, pose and health out.

use std::sync::{Mutex, TryLockError};
use std::time::{Duration, Instant};

use agv_controller::{Bus, BusOutput, ChangeableSettings, SettingObjects};
use agv_settings::service::Controller;
use agv_wire::can::canopen::Message;
use agv_wire::can::controller_node::ErrorKind;
use agv_wire::can::sdo::{AbortCode, Object, ObjectDictionary, ValueBytes};

use super::bus_port::BusPort;
use super::exchange::{Exchange, Task};
use super::fault::Fault;
use super::flash_file::FlashFile;
use super::periods::PeriodClock;
use crate::bus::BusChange;

/// How often state machines are asked what is due, as on a board.
const STEP: Duration = Duration::from_millis(1);
/// By how much a step comes later than what is due at it: a thread never wakes early, so it then wakes behind that always, not now
/// and then.
const BEHIND: Duration = Duration::from_micros(50);

/// The settings of the service port. While that is busy with them, as when it writes the store, they are not served.
struct SharedSettings<'a> {
    controller: &'a Mutex<Controller<FlashFile>>,
}

impl SharedSettings<'_> {
    fn with<T>(&self, use_it: impl FnOnce(&mut Controller<FlashFile>) -> Result<T, AbortCode>) -> Result<T, AbortCode> {
        match self.controller.try_lock() {
            Ok(mut controller) => use_it(&mut controller),
            Err(TryLockError::Poisoned(poisoned)) => use_it(&mut poisoned.into_inner()),
            Err(TryLockError::WouldBlock) => Err(AbortCode::DeviceState),
        }
    }
}

impl ObjectDictionary for SharedSettings<'_> {
    fn read(&self, object: Object) -> Result<ValueBytes, AbortCode> {
        self.with(|controller| SettingObjects::new(&controller.settings).read(object))
    }

    fn writable(&self, object: Object) -> Result<usize, AbortCode> {
        self.with(|controller| ChangeableSettings::new(&mut controller.settings).writable(object))
    }

    fn write(&mut self, object: Object, bytes: &[u8]) -> Result<(), AbortCode> {
        self.with(|controller| ChangeableSettings::new(&mut controller.settings).write(object, bytes))
    }
}

/// What the loop works with.
pub(super) struct BusLoop<'a> {
    bus: Bus,
    port: BusPort,
    exchange: &'a Exchange,
    objects: SharedSettings<'a>,
    clock: PeriodClock,
    /// Events that were lost until the last step.
    lost_events: u32,
}

impl<'a> BusLoop<'a> {
    /// A loop that has not begun, with so much time between poses.
    pub fn new(
        (bus, port): (Bus, BusPort),
        exchange: &'a Exchange,
        controller: &'a Mutex<Controller<FlashFile>>,
        period: Duration,
    ) -> Self {
        let (objects, clock) = (SharedSettings { controller }, PeriodClock::new(period));
        Self { bus, port, exchange, objects, clock, lost_events: exchange.lost_events() }
    }

    /// Takes part in the bus, which began at `begin`, until everything ends. `note` is told what becomes of it.
    pub fn run(mut self, begin: Instant, note: &(dyn Fn(&str) + Sync)) {
        let mut tick = begin + BEHIND;
        while !self.exchange.is_over() {
            self.step(tick, note);
            let now = Instant::now();
            while tick <= now {
                tick += STEP;
            }
        }
    }

    /// Waits for a frame, but not beyond `tick`; hears it, and sends what is due.
    pub fn step(&mut self, tick: Instant, note: &(dyn Fn(&str) + Sync)) {
        if let Some(remark) = self.port.mend() {
            note(&remark);
        }
        let heard = self.port.hear(tick);
        let Self { bus, port, exchange, objects, clock, lost_events } = self;
        exchange.check_in(Task::Bus);
        if let Some(change) = port.take_change() {
            note(&format!("can: {}", word(change)));
            if let Some(kind) = error(change) {
                bus.report(kind, exchange.now());
            }
        }
        if std::mem::replace(lost_events, exchange.lost_events()) != *lost_events {
            bus.report(ErrorKind::Overload, exchange.now());
        }
        if let Some(is_stored) = exchange.saved() {
            if !is_stored {
                bus.report(ErrorKind::SettingsLost, exchange.now());
            }
            if let Some(answer) = bus.saved(is_stored) {
                port.send(&answer);
            }
        }
        if let Some(estimate) = exchange.newest_estimate() {
            bus.update(&estimate);
        }
        let (mut is_sent, mut is_late) = (true, false);
        let mut take = |output| match output {
            // A frame for which there is no room is left out; what it says is said again.
            BusOutput::Send(frame) => {
                if let Ok(Message::Emergency { emergency, .. }) = Message::decode(&frame) {
                    exchange.tell_fault(Fault::of(&emergency));
                }
                is_sent &= port.send(&frame);
            }
            BusOutput::Event(told) => exchange.pass_on(told),
            BusOutput::Published(published) => {
                if is_sent {
                    is_late |= clock.sent(exchange.now(), &exchange.periods);
                }
                exchange.published(&published);
            }
            BusOutput::Save(parameters) => {
                if !exchange.save(parameters) {
                    exchange.tell_saved(false);
                }
            }
        };
        if let Some((frame, heard)) = &heard {
            bus.hear(frame, *heard, objects, &mut take);
        }
        while let Some(output) = exchange.next_gyro().and_then(|sample| bus.hear_gyro(&sample)) {
            take(output);
        }
        bus.poll(exchange.now(), exchange.laser_health(), &mut take);
        if is_late {
            bus.report(ErrorKind::Overload, exchange.now());
        }
        if let Some(speed) = bus.laser_speed() {
            exchange.set_laser_speed(speed);
        }
        if let Some(inputs) = exchange.newest_discrete_inputs() {
            bus.hear_lines(&inputs, exchange.now());
        }
        exchange.set_discrete_report(bus.discrete_report(exchange.now()));
        let state = port.state();
        if state != super::exchange::BusState::Open {
            clock.interrupt();
        }
        exchange.set_bus(state);
        exchange.set_standing(bus.is_standing(exchange.now()));
        // A master may have others watched.
        port.listen_to(&bus.nodes(), &bus.other_frames());
    }
}

const fn word(change: BusChange) -> &'static str {
    match change {
        BusChange::Overrun => "frames came faster than they were taken",
        BusChange::Off => "errors have driven the controller off the bus",
        BusChange::BackFromOff => "the controller is back on the bus",
    }
}

/// What is told of a change of the bus.
const fn error(change: BusChange) -> Option<ErrorKind> {
    match change {
        BusChange::Overrun => Some(ErrorKind::Overrun),
        BusChange::Off => None,
        BusChange::BackFromOff => Some(ErrorKind::BusOff),
    }
}
