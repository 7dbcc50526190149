//! A drive of the profile CiA 402, as a node on a bus: it was started by the vehicle's own controller.

use agv_core::measurement::Time;
use agv_wire::can::canopen::{Message, NodeId, transmit_pdo_id};
use agv_wire::can::drive_402::POSITION_PDO;
use agv_wire::can::frame::Frame;
use agv_wire::can::nmt::NmtState;

/// Its status word: operation enabled, target reached (CiA 402-2, "Statusword").
const STATUS: u16 = 0x0627;

/// One drive, which tells its position by itself.
#[derive(Clone, Debug)]
pub struct EmulatedDrive {
    node: NodeId,
    period: f64,
    position: u32,
    next: Option<Time>,
}

impl EmulatedDrive {
    /// A drive that has just been switched on, and tells its position every `period` seconds.
    #[must_use]
    pub const fn new(node: NodeId, period: f64) -> Self {
        Self { node, period, position: 0, next: None }
    }

    /// Turns the motor to a position.
    pub const fn set_position(&mut self, position: u32) {
        self.position = position;
    }

    /// The next frame that is due by itself. Call until there is none.
    pub fn poll(&mut self, now: Time) -> Option<Frame> {
        let Some(due) = self.next else {
            self.next = Some(now);
            return Some(Message::Heartbeat { node: self.node, state: NmtState::BootUp }.encode());
        };
        if now < due {
            return None;
        }
        let next = due.offset(self.period);
        self.next = Some(if next <= now { now.offset(self.period) } else { next });
        let [low, high] = STATUS.to_le_bytes();
        let [a, b, c, d] = self.position.to_le_bytes();
        Some(Frame::of(transmit_pdo_id(self.node, POSITION_PDO), [low, high, a, b, c, d]))
    }
}
