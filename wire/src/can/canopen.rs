//! CANopen (CiA 301): nodes, the predefined identifiers, and the messages behind them.

use super::emcy::Emergency;
use super::frame::{Frame, Id, standard_id};
use super::nmt::{NmtCommand, NmtState};

/// Number of a node, 1 to 127.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(u8);

impl NodeId {
    /// The node with that number. None unless 1 to 127.
    #[must_use]
    pub const fn new(number: u8) -> Option<Self> {
        if number >= 1 && number <= 127 { Some(Self(number)) } else { None }
    }

    /// The number, 1 to 127.
    #[must_use]
    pub const fn number(self) -> u8 {
        self.0
    }
}

/// What the identifiers of the predefined connection set begin with (CiA 301, 7.3.5).
mod function {
    pub const NMT: u16 = 0x000;
    pub const SYNC: u16 = 0x080;
    pub const EMERGENCY: u16 = 0x080;
    pub const TRANSMIT_PDO: u16 = 0x180;
    pub const RECEIVE_PDO: u16 = 0x200;
    pub const FIFTH_TRANSMIT_PDO: u16 = 0x680;
    pub const SDO_RESPONSE: u16 = 0x580;
    pub const SDO_REQUEST: u16 = 0x600;
    pub const HEARTBEAT: u16 = 0x700;
}

/// A message of the predefined connection set. The bytes of an SDO are looked at in [`sdo`](super::sdo).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Message {
    /// A command of the NMT master, to one node or to all.
    Nmt {
        /// The command.
        command: NmtCommand,
        /// The node, or all nodes.
        node: Option<NodeId>,
    },
    /// The moment at which synchronous nodes read their inputs, with the counter that some producers send.
    Sync {
        /// Counter, 1 to 240, if the producer counts.
        counter: Option<u8>,
    },
    /// A node reports an error, or that it is over.
    Emergency {
        /// The node.
        node: NodeId,
        /// What happened.
        emergency: Emergency,
    },
    /// A node's process data.
    TransmitPdo {
        /// The node.
        node: NodeId,
        /// Number of the PDO, 1 to 4.
        number: u8,
        /// The frame that holds the data.
        frame: Frame,
    },
    /// Process data for a node.
    ReceivePdo {
        /// The node.
        node: NodeId,
        /// Number of the PDO, 1 to 4.
        number: u8,
        /// The frame that holds the data.
        frame: Frame,
    },
    /// A node's answer to an access to its objects.
    SdoResponse {
        /// The node.
        node: NodeId,
        /// The eight bytes.
        bytes: [u8; 8],
    },
    /// An access to a node's objects.
    SdoRequest {
        /// The node.
        node: NodeId,
        /// The eight bytes.
        bytes: [u8; 8],
    },
    /// A node has booted, or is alive.
    Heartbeat {
        /// The node.
        node: NodeId,
        /// Its state.
        state: NmtState,
    },
}

/// Why a frame is no message of the predefined connection set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CanopenError {
    /// The identifier has 29 bits, belongs to no message, or the frame is a request.
    Foreign,
    /// The message cannot have that length.
    Length,
    /// A command, state or node has no meaning.
    Value,
}

impl Message {
    /// The message in a frame.
    ///
    /// # Errors
    /// See [`CanopenError`].
    pub fn decode(frame: &Frame) -> Result<Self, CanopenError> {
        let Id::Standard(id) = frame.id() else { return Err(CanopenError::Foreign) };
        if frame.is_remote() {
            return Err(CanopenError::Foreign);
        }
        let (group, number) = (id.as_raw() & 0x780, (id.as_raw() & 0x7F) as u8);
        let data = frame.data();
        let node = NodeId::new(number);
        let Some(node) = node else {
            return match (group, data) {
                (function::NMT, [command, node]) => {
                    let command = NmtCommand::from_code(*command).ok_or(CanopenError::Value)?;
                    match (*node, NodeId::new(*node)) {
                        (0, _) => Ok(Self::Nmt { command, node: None }),
                        (_, None) => Err(CanopenError::Value),
                        (_, node) => Ok(Self::Nmt { command, node }),
                    }
                }
                (function::SYNC, []) => Ok(Self::Sync { counter: None }),
                (function::SYNC, [counter]) => Ok(Self::Sync { counter: Some(*counter) }),
                (function::NMT | function::SYNC, _) => Err(CanopenError::Length),
                _ => Err(CanopenError::Foreign),
            };
        };
        let eight = || <[u8; 8]>::try_from(data).map_err(|_| CanopenError::Length);
        match group {
            function::EMERGENCY => Ok(Self::Emergency { node, emergency: Emergency::decode(eight()?) }),
            0x180 | 0x280 | 0x380 | 0x480 => Ok(Self::TransmitPdo { node, number: (group >> 8) as u8, frame: *frame }),
            0x200 | 0x300 | 0x400 | 0x500 => {
                Ok(Self::ReceivePdo { node, number: (group >> 8) as u8 - 1, frame: *frame })
            }
            function::SDO_RESPONSE => Ok(Self::SdoResponse { node, bytes: eight()? }),
            function::SDO_REQUEST => Ok(Self::SdoRequest { node, bytes: eight()? }),
            function::HEARTBEAT => match data {
                [state] => {
                    let state = NmtState::from_code(*state).ok_or(CanopenError::Value)?;
                    Ok(Self::Heartbeat { node, state })
                }
                _ => Err(CanopenError::Length),
            },
            _ => Err(CanopenError::Foreign),
        }
    }

    /// The message as a frame.
    #[must_use]
    pub fn encode(&self) -> Frame {
        let id = |group: u16, node: NodeId| standard_id(group | u16::from(node.number()));
        match self {
            Self::Nmt { command, node } => {
                Frame::of(standard_id(function::NMT), [command.code(), node.map_or(0, NodeId::number)])
            }
            Self::Sync { counter: None } => Frame::of(standard_id(function::SYNC), []),
            Self::Sync { counter: Some(counter) } => Frame::of(standard_id(function::SYNC), [*counter]),
            Self::Emergency { node, emergency } => Frame::of(id(function::EMERGENCY, *node), emergency.encode()),
            Self::TransmitPdo { frame, .. } | Self::ReceivePdo { frame, .. } => *frame,
            Self::SdoResponse { node, bytes } => Frame::of(id(function::SDO_RESPONSE, *node), *bytes),
            Self::SdoRequest { node, bytes } => Frame::of(id(function::SDO_REQUEST, *node), *bytes),
            Self::Heartbeat { node, state } => Frame::of(id(function::HEARTBEAT, *node), [state.code()]),
        }
    }
}

/// The predefined identifier of a node's transmit PDO, 1 to 4; higher numbers count as 4, zero as 1.
#[must_use]
pub fn transmit_pdo_id(node: NodeId, number: u8) -> Id {
    let offset = u16::from(number.clamp(1, 4) - 1) << 8;
    standard_id(function::TRANSMIT_PDO + offset + u16::from(node.number()))
}

/// The identifier of a node's fifth transmit PDO. None is predefined for it; this one is free for nodes up to 95 (CiA 301,
/// tables 38 and 39).
#[must_use]
pub fn fifth_transmit_pdo_id(node: NodeId) -> Id {
    standard_id(function::FIFTH_TRANSMIT_PDO + u16::from(node.number()))
}

/// The predefined identifier of a node's receive PDO, 1 to 4; higher numbers count as 4, zero as 1.
#[must_use]
pub fn receive_pdo_id(node: NodeId, number: u8) -> Id {
    let offset = u16::from(number.clamp(1, 4) - 1) << 8;
    standard_id(function::RECEIVE_PDO + offset + u16::from(node.number()))
}
