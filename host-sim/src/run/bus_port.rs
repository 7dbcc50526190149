//! A bus that comes back by itself.

use std::time::{Duration, Instant};

use agv_core::measurement::Time;
use agv_wire::can::canopen::NodeId;
use agv_wire::can::frame::{Frame, Id};

use super::exchange::BusState;
use crate::bus::{Bus, BusChange, BusError};
use crate::link::clock::Clock;

/// Pause before a bus that was lost is opened again: far below the 5 s in which a vehicle localises again.
const PAUSE: Duration = Duration::from_millis(200);

/// What opens the bus, again and again if it is lost.
pub type OpenBus = Box<dyn FnMut() -> Result<Box<dyn Bus>, BusError> + Send>;

/// A bus, if there is one just now.
pub(super) struct BusPort {
    open: OpenBus,
    bus: Option<Box<dyn Bus>>,
    tried: Option<Instant>,
    nodes: Vec<NodeId>,
    others: Vec<Id>,
    is_off: bool,
    /// Whether somebody has heard that it is lost.
    is_told: bool,
    /// Why it was lost just now.
    loss: Option<BusError>,
    clock: Clock,
    /// When the last frame was heard: none is heard before the one before it.
    heard: Time,
}

impl BusPort {
    /// A bus that is not open yet, of which frames from and for these nodes are heard, and the other ones.
    pub fn new(open: OpenBus, clock: Clock, nodes: &[NodeId], others: &[Id]) -> Self {
        Self {
            open,
            bus: None,
            tried: None,
            nodes: nodes.to_vec(),
            others: others.to_vec(),
            is_off: false,
            is_told: false,
            loss: None,
            clock,
            heard: Time::default(),
        }
    }

    /// How it is.
    pub fn state(&self) -> BusState {
        match (&self.bus, self.is_off) {
            (None, _) => BusState::Lost,
            (Some(_), true) => BusState::Off,
            (Some(_), false) => BusState::Open,
        }
    }

    /// Hears other nodes from now on.
    pub fn listen_to(&mut self, nodes: &[NodeId], others: &[Id]) {
        if self.nodes == nodes && self.others == others {
            return;
        }
        self.nodes = nodes.to_vec();
        self.others = others.to_vec();
        if let Some(bus) = &mut self.bus
            && let Err(error) = bus.listen_to(nodes, others)
        {
            self.lose(error);
        }
    }

    /// Opens the bus if it is lost and was not tried just now. What there is to say of it, if that is new.
    pub fn mend(&mut self) -> Option<String> {
        if let Some(error) = self.loss.take() {
            return self.complain(&error);
        }
        let is_due = self.bus.is_none() && self.tried.is_none_or(|tried| tried.elapsed() >= PAUSE);
        if !is_due {
            return None;
        }
        self.tried = Some(Instant::now());
        let opened = (self.open)().and_then(|mut bus| bus.listen_to(&self.nodes, &self.others).map(|()| bus));
        match opened {
            Ok(bus) => {
                self.bus = Some(bus);
                std::mem::take(&mut self.is_told).then(|| "can: the bus is open again".to_owned())
            }
            Err(error) => self.complain(&error),
        }
    }

    /// Says why there is no bus, once.
    fn complain(&mut self, error: &BusError) -> Option<String> {
        let is_new = !std::mem::replace(&mut self.is_told, true);
        is_new.then(|| format!("can: {error}; it is tried again every {} ms", PAUSE.as_millis()))
    }

    fn lose(&mut self, error: BusError) {
        (self.bus, self.is_off, self.tried, self.loss) = (None, false, Some(Instant::now()), Some(error));
    }

    /// The next classic frame of others, and when its end was heard. None if there is none until `deadline`.
    pub fn hear(&mut self, deadline: Instant) -> Option<(Frame, Time)> {
        let Some(bus) = &mut self.bus else {
            std::thread::sleep(deadline.saturating_duration_since(Instant::now()));
            return None;
        };
        match bus.hear(deadline) {
            Ok(heard) => {
                let heard = heard?;
                let time = self.clock.now().offset(-heard.age.as_secs_f64()).max(self.heard);
                self.heard = time;
                heard.frame.classic().map(|frame| (*frame, time))
            }
            Err(error) => {
                self.lose(error);
                None
            }
        }
    }

    /// Sends a frame; false if it is left out, as there is no room for it, or no bus.
    pub fn send(&mut self, frame: &Frame) -> bool {
        let Some(bus) = &mut self.bus else { return false };
        match bus.offer(&(*frame).into()) {
            Ok(is_sent) => is_sent,
            Err(error) => {
                self.lose(error);
                false
            }
        }
    }

    /// What has become of the bus since the last call.
    pub fn take_change(&mut self) -> Option<BusChange> {
        let change = self.bus.as_mut()?.take_change()?;
        match change {
            BusChange::Off => self.is_off = true,
            BusChange::BackFromOff => self.is_off = false,
            BusChange::Overrun => {}
        }
        Some(change)
    }
}
