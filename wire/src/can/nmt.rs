//! Network management (CiA 301, 7.2.8 and 7.3.2): commands, states, heartbeats.

use agv_core::measurement::Time;

/// What a master tells nodes to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NmtCommand {
    /// Become operational: process data flow.
    Start,
    /// Become stopped: only NMT and heartbeat remain.
    Stop,
    /// Become pre-operational: no process data.
    EnterPreOperational,
    /// Restart the application.
    ResetNode,
    /// Restart communication.
    ResetCommunication,
}

impl NmtCommand {
    /// The command with that code.
    #[must_use]
    pub const fn from_code(code: u8) -> Option<Self> {
        Some(match code {
            0x01 => Self::Start,
            0x02 => Self::Stop,
            0x80 => Self::EnterPreOperational,
            0x81 => Self::ResetNode,
            0x82 => Self::ResetCommunication,
            _ => return None,
        })
    }

    /// The command's code.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Start => 0x01,
            Self::Stop => 0x02,
            Self::EnterPreOperational => 0x80,
            Self::ResetNode => 0x81,
            Self::ResetCommunication => 0x82,
        }
    }
}

/// What a node says of itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NmtState {
    /// It has just booted and is pre-operational now.
    BootUp,
    /// Only NMT and heartbeat.
    Stopped,
    /// Process data flow.
    Operational,
    /// Objects can be accessed; no process data.
    PreOperational,
}

impl NmtState {
    /// The state with that code. The toggle bit of the older node guarding is left out.
    #[must_use]
    pub const fn from_code(code: u8) -> Option<Self> {
        Some(match code & 0x7F {
            0x00 => Self::BootUp,
            0x04 => Self::Stopped,
            0x05 => Self::Operational,
            0x7F => Self::PreOperational,
            _ => return None,
        })
    }

    /// The state's code.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::BootUp => 0x00,
            Self::Stopped => 0x04,
            Self::Operational => 0x05,
            Self::PreOperational => 0x7F,
        }
    }
}

/// Watches that a node is alive.
#[derive(Clone, Copy, Debug)]
pub struct HeartbeatConsumer {
    longest_gap: f64,
    last: Option<Time>,
}

impl HeartbeatConsumer {
    /// A consumer that has heard nothing yet; silence longer than `longest_gap` (s) counts as loss.
    #[must_use]
    pub const fn new(longest_gap: f64) -> Self {
        Self { longest_gap, last: None }
    }

    /// The node has said its state.
    pub fn hear(&mut self, time: Time) {
        self.last = Some(time);
    }

    /// The node starts anew.
    pub fn forget(&mut self) {
        self.last = None;
    }

    /// Whether the node has been heard once and then not for too long. A node that never sends heartbeats is not lost:
    /// not all of them can.
    #[must_use]
    pub fn is_lost(&self, now: Time) -> bool {
        self.last.is_some_and(|last| now.since(last) > self.longest_gap)
    }
}
