//! The controller as a node of a CANopen bus: boot-up, heartbeat, NMT and its object dictionary, as `docs/agv.eds` has them.
//!
//! The node starts by itself. Its dictionary can only be read: what the controller is told by others comes in PDOs, and
//! its settings have a port of their own.

use super::canopen::{Message, NodeId};
use super::frame::Frame;
use super::nmt::{NmtCommand, NmtState};
use super::sdo::{AbortCode, Object, Request, Response, Value};
use agv_core::measurement::Time;

/// Time between heartbeats, ms.
pub const HEARTBEAT_TIME: u16 = 100;

/// PDOs that the controller receives and transmits.
const RECEIVE_PDOS: u16 = 3;
const TRANSMIT_PDOS: u16 = 5;
/// Event timer of the transmit PDOs, ms.
const EVENT_TIMER: u16 = 10;
/// Transmission type of all PDOs: when the device decides (CiA 301, table 72).
const BY_EVENT: u8 = 254;
/// What the transmit PDOs hold, an object of 64 bits each.
const TRANSMITTED: [u16; TRANSMIT_PDOS as usize] = [0x2001, 0x2002, 0x2003, 0x2004, 0x2008];
/// What the receive PDOs hold.
const RECEIVED: [u16; RECEIVE_PDOS as usize] = [0x2005, 0x2006, 0x2007];

/// Revision of what is said and heard: it goes up where a signal changes its meaning.
const REVISION: u32 = 3;

/// The controller as a node.
#[derive(Clone, Copy, Debug)]
pub struct ControllerNode {
    node: NodeId,
    state: NmtState,
    has_booted: bool,
    next_heartbeat: Time,
}

impl ControllerNode {
    /// A node that was just switched on.
    #[must_use]
    pub const fn new(node: NodeId, now: Time) -> Self {
        Self { node, state: NmtState::Operational, has_booted: false, next_heartbeat: now }
    }

    /// Whether PDOs are sent and heard.
    #[must_use]
    pub fn is_operational(&self) -> bool {
        self.has_booted && self.state == NmtState::Operational
    }

    /// The next frame that is due by itself. Call until there is none.
    pub fn poll(&mut self, now: Time) -> Option<Frame> {
        if !self.has_booted {
            self.has_booted = true;
            self.next_heartbeat = now;
            return Some(Message::Heartbeat { node: self.node, state: NmtState::BootUp }.encode());
        }
        if now < self.next_heartbeat {
            return None;
        }
        let period = f64::from(HEARTBEAT_TIME) * 1e-3;
        let following = self.next_heartbeat.offset(period);
        self.next_heartbeat = if following <= now { now.offset(period) } else { following };
        Some(Message::Heartbeat { node: self.node, state: self.state }.encode())
    }

    /// Takes a frame; gives the answer, if there is one.
    pub fn handle(&mut self, frame: &Frame) -> Option<Frame> {
        match Message::decode(frame).ok()? {
            Message::Nmt { command, node } if node.is_none_or(|node| node == self.node) => {
                match command {
                    NmtCommand::Start => self.state = NmtState::Operational,
                    NmtCommand::Stop => self.state = NmtState::Stopped,
                    NmtCommand::EnterPreOperational => self.state = NmtState::PreOperational,
                    NmtCommand::ResetNode | NmtCommand::ResetCommunication => {
                        self.state = NmtState::Operational;
                        self.has_booted = false;
                    }
                }
                None
            }
            Message::SdoRequest { node, bytes } if node == self.node && self.state != NmtState::Stopped => {
                let response = match Request::decode(bytes).ok()? {
                    Request::Abort(..) => return None,
                    Request::Read(object) => match self.object(object) {
                        Ok(value) => Response::Read(object, value),
                        Err(reason) => Response::Abort(object, reason),
                    },
                    Request::Write(object, _) => match self.object(object) {
                        Ok(_) => Response::Abort(object, AbortCode::ReadOnly),
                        Err(reason) => Response::Abort(object, reason),
                    },
                };
                Some(Message::SdoResponse { node, bytes: response.encode() }.encode())
            }
            _ => None,
        }
    }

    fn object(&self, Object { index, sub }: Object) -> Result<Value, AbortCode> {
        let missing = if sub == 0 { AbortCode::NoSuchObject } else { AbortCode::NoSuchSubindex };
        let receive = |base: u16| (base..base + RECEIVE_PDOS).contains(&index).then(|| index - base);
        let transmit = |base: u16| (base..base + TRANSMIT_PDOS).contains(&index).then(|| index - base);
        // An object of 64 bits: the whole content of a PDO.
        let mapping = |sub: u8, content: u16| match sub {
            0 => Ok(Value::from(1u8)),
            1 => Ok(Value::from(u32::from(content) << 16 | 64)),
            _ => Err(missing),
        };
        let id = |base: u32, number: u16| Value::from(base + 0x100 * u32::from(number) + u32::from(self.node.number()));
        if let Some(number) = receive(0x1400) {
            return match sub {
                0 => Ok(Value::from(2u8)),
                1 => Ok(id(0x200, number)),
                2 => Ok(Value::from(BY_EVENT)),
                _ => Err(missing),
            };
        }
        if let Some(number) = transmit(0x1800) {
            return match sub {
                0 => Ok(Value::from(5u8)),
                1 if number == 4 => Ok(id(0x680, 0)),
                1 => Ok(id(0x180, number)),
                2 => Ok(Value::from(BY_EVENT)),
                3 => Ok(Value::from(0u16)),
                5 => Ok(Value::from(EVENT_TIMER)),
                _ => Err(missing),
            };
        }
        let content = |list: &[u16], number: u16| list.get(usize::from(number)).copied().ok_or(missing);
        if let Some(number) = transmit(0x1A00) {
            return mapping(sub, content(&TRANSMITTED, number)?);
        }
        if let Some(number) = receive(0x1600) {
            return mapping(sub, content(&RECEIVED, number)?);
        }
        match (index, sub) {
            (0x1000, 0) => Ok(Value::from(0u32)),
            (0x1001, 0) => Ok(Value::from(0u8)),
            (0x1017, 0) => Ok(Value::from(HEARTBEAT_TIME)),
            (0x1018, 0) => Ok(Value::from(4u8)),
            (0x1018, 3) => Ok(Value::from(REVISION)),
            (0x1018, 1 | 2 | 4) => Ok(Value::from(0u32)),
            // Longer than an expedited transfer; they are heard and sent as PDOs.
            (0x2001..=0x2008, 0) => Err(AbortCode::UnsupportedAccess),
            _ => Err(missing),
        }
    }
}
