//! An encoder of the profile CiA 406, as a node on a bus.

use std::collections::BTreeMap;

use agv_core::measurement::Time;
use agv_core::odometry::CounterRange;
use agv_wire::can::canopen::{Message, NodeId, transmit_pdo_id};
use agv_wire::can::encoder::object;
use agv_wire::can::frame::Frame;
use agv_wire::can::nmt::{NmtCommand, NmtState};
use agv_wire::can::sdo::{AbortCode, Object, Request, Response, Value};

/// Objects that a master may write.
const WRITABLE: [Object; 4] =
    [object::HEARTBEAT_TIME, object::PDO_TRANSMISSION, object::PDO_INHIBIT_TIME, object::PDO_EVENT_TIMER];

/// One encoder.
#[derive(Clone, Debug)]
pub struct EmulatedEncoder {
    node: NodeId,
    objects: BTreeMap<(u16, u8), Value>,
    state: NmtState,
    position: u32,
    next_heartbeat: Time,
    next_pdo: Time,
    has_booted: bool,
}

impl EmulatedEncoder {
    /// An encoder that has just been switched on. It tells its range as most devices do: the largest position if the range
    /// is a power of two.
    #[must_use]
    pub fn new(node: NodeId, range: CounterRange) -> Self {
        let values = range.values();
        let told = if values.is_power_of_two() { values - 1 } else { values };
        let pdo_id = 0x180 + u32::from(node.number());
        let objects = [
            (Object::new(0x1000, 0), Value::from(0x0002_0196u32)),
            (object::HEARTBEAT_TIME, Value::from(0u16)),
            (object::PDO_ID, Value::from(pdo_id)),
            (object::PDO_TRANSMISSION, Value::from(254u8)),
            (object::PDO_INHIBIT_TIME, Value::from(0u16)),
            (object::PDO_EVENT_TIMER, Value::from(0u16)),
            (object::PDO_MAPPING, Value::from(1u8)),
            (Object::new(0x1A00, 1), Value::from(0x6004_0020u32)),
            (object::UNITS_PER_REVOLUTION, Value::from(4096u32)),
            (object::MEASURING_RANGE, Value::from(told as u32)),
            (object::SINGLE_TURN_RESOLUTION, Value::from(4096u32)),
        ];
        let objects = objects.into_iter().map(|(object, value)| ((object.index, object.sub), value)).collect();
        let state = NmtState::BootUp;
        let (next_heartbeat, next_pdo) = (Time::default(), Time::default());
        Self { node, objects, state, position: 0, next_heartbeat, next_pdo, has_booted: false }
    }

    /// Turns the shaft to a position.
    pub fn set_position(&mut self, position: u32) {
        self.position = position;
    }

    /// Whether it sends process data.
    #[must_use]
    pub fn is_operational(&self) -> bool {
        self.state == NmtState::Operational
    }

    fn number(&self, object: Object) -> u32 {
        self.objects.get(&(object.index, object.sub)).map_or(0, |value| value.unsigned())
    }

    fn pdo(&self) -> Frame {
        Frame::of(transmit_pdo_id(self.node, 1), self.position.to_le_bytes())
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
                matches!(self.number(object::PDO_TRANSMISSION), 1..=240).then(|| self.pdo())
            }
            Message::SdoRequest { node, bytes } if node == self.node && self.state != NmtState::Stopped => {
                let response = self.access(Request::decode(bytes).ok()?)?;
                Some(Message::SdoResponse { node, bytes: response.encode() }.encode())
            }
            _ => None,
        }
    }

    fn access(&mut self, request: Request) -> Option<Response> {
        match request {
            Request::Abort(..) => None,
            Request::Read(asked) if asked == object::POSITION => Some(Response::Read(asked, self.position.into())),
            Request::Read(asked) => Some(match self.objects.get(&(asked.index, asked.sub)) {
                Some(value) => Response::Read(asked, *value),
                None => Response::Abort(asked, AbortCode::NoSuchObject),
            }),
            Request::Write(asked, value) => Some(match self.objects.get_mut(&(asked.index, asked.sub)) {
                None => Response::Abort(asked, AbortCode::NoSuchObject),
                Some(_) if !WRITABLE.contains(&asked) => Response::Abort(asked, AbortCode::ReadOnly),
                Some(known) if known.bytes().len() != value.bytes().len() => {
                    Response::Abort(asked, AbortCode::LengthMismatch)
                }
                Some(known) => {
                    *known = value;
                    Response::Written(asked)
                }
            }),
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
            return Some(self.pdo());
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
