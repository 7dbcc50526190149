//! An encoder of the profile CiA 406, as a node on a bus.

use agv_core::measurement::Time;
use agv_core::odometry::CounterRange;
use agv_wire::can::canopen::{Message, NodeId};
use agv_wire::can::encoder::object;
use agv_wire::can::frame::{Frame, standard_id};
use agv_wire::can::nmt::{NmtCommand, NmtState};
use agv_wire::can::sdo::{Object, SdoServer};

use super::encoder_objects::{EncoderObjects, PDO_OFF};

/// One encoder.
#[derive(Clone, Debug)]
pub struct EmulatedEncoder {
    node: NodeId,
    objects: EncoderObjects,
    sdo: SdoServer,
    state: NmtState,
    next_heartbeat: Time,
    next_pdo: Time,
    has_booted: bool,
}

impl EmulatedEncoder {
    /// An encoder that has just been switched on.
    #[must_use]
    pub fn new(node: NodeId, range: CounterRange) -> Self {
        Self {
            node,
            objects: EncoderObjects::new(node, range),
            sdo: SdoServer::new(),
            state: NmtState::BootUp,
            next_heartbeat: Time::default(),
            next_pdo: Time::default(),
            has_booted: false,
        }
    }

    /// Turns the shaft to a position.
    pub fn set_position(&mut self, position: u32) {
        self.objects.turn(position);
    }

    /// Whether it sends process data.
    #[must_use]
    pub fn is_operational(&self) -> bool {
        self.state == NmtState::Operational
    }

    fn number(&self, object: Object) -> u32 {
        self.objects.number(object)
    }

    /// The process data, if they are on.
    fn pdo(&self) -> Option<Frame> {
        let id = self.number(object::PDO_ID);
        let standard = u16::try_from(id & !PDO_OFF).ok().filter(|_| id & PDO_OFF == 0)?;
        Frame::new(standard_id(standard), &self.objects.process_data())
    }

    /// What the encoder answers at once.
    pub fn handle(&mut self, frame: &Frame) -> Option<Frame> {
        match Message::decode(frame).ok()? {
            Message::Nmt { command, node } if node.is_none_or(|node| node == self.node) => {
                match command {
                    NmtCommand::Start => self.state = NmtState::Operational,
                    NmtCommand::Stop => self.state = NmtState::Stopped,
                    NmtCommand::EnterPreOperational => self.state = NmtState::PreOperational,
                    NmtCommand::ResetNode | NmtCommand::ResetCommunication => self.has_booted = false,
                }
                None
            }
            Message::Sync { .. } if self.is_operational() => {
                self.pdo().filter(|_| matches!(self.number(object::PDO_TRANSMISSION), 1..=240))
            }
            Message::SdoRequest { node, bytes } if node == self.node && self.state != NmtState::Stopped => {
                let bytes = self.sdo.answer(&mut self.objects, bytes)?;
                Some(Message::SdoResponse { node, bytes }.encode())
            }
            _ => None,
        }
    }

    /// The next frame that is due by itself. Call until there is none.
    pub fn poll(&mut self, now: Time) -> Option<Frame> {
        if !self.has_booted {
            self.has_booted = true;
            self.state = NmtState::PreOperational;
            self.next_heartbeat = now;
            self.next_pdo = now;
            return Some(Message::Heartbeat { node: self.node, state: NmtState::BootUp }.encode());
        }
        let heartbeat = self.number(object::HEARTBEAT_TIME);
        if heartbeat > 0 && now >= self.next_heartbeat {
            self.next_heartbeat = later(self.next_heartbeat, heartbeat, now);
            return Some(Message::Heartbeat { node: self.node, state: self.state }.encode());
        }
        let timer = self.number(object::PDO_EVENT_TIMER);
        let has_timer = self.number(object::PDO_TRANSMISSION) >= 254 && timer > 0;
        if has_timer && self.is_operational() && now >= self.next_pdo {
            self.next_pdo = later(self.next_pdo, timer, now);
            return self.pdo();
        }
        None
    }
}

/// The next moment of a period of that many ms; moments that were missed are left out.
fn later(last: Time, milliseconds: u32, now: Time) -> Time {
    let period = f64::from(milliseconds) * 1e-3;
    let next = last.offset(period);
    if next <= now { now.offset(period) } else { next }
}
