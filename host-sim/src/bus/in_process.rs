//! A bus inside this program, for tests and emulators.

use std::sync::Arc;
use std::time::Instant;

use agv_wire::can::frame::AnyFrame;

use super::{Bus, BusError};
use crate::sync::lock::Lock;
use crate::sync::queue::{Closed, Receiver, Sender, queue};

/// Frames that wait for a node; what comes while it takes none is lost for it, as in a CAN controller. A second of a full bus of
/// 500 kbit/s, whose shortest frames have 47 bits, has 10,600.
const QUEUE: usize = 16_384;

/// The wire. What one node sends, all others receive, in the order of sending.
#[derive(Clone, Debug, Default)]
pub struct InProcessBus {
    nodes: Arc<Lock<Vec<Sender<AnyFrame>>>>,
}

/// One node on the wire.
#[derive(Debug)]
pub struct InProcessNode {
    bus: InProcessBus,
    number: usize,
    received: Receiver<AnyFrame>,
}

impl InProcessBus {
    /// A wire without nodes.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a node; it receives what is sent from now on.
    #[must_use]
    pub fn join(&self) -> InProcessNode {
        let (sender, received) = queue(QUEUE);
        let mut nodes = self.nodes.lock();
        nodes.push(sender);
        InProcessNode { bus: self.clone(), number: nodes.len() - 1, received }
    }
}

impl Bus for InProcessNode {
    fn send(&mut self, frame: &AnyFrame) -> Result<(), BusError> {
        let nodes = self.bus.nodes.lock();
        for (number, node) in nodes.iter().enumerate() {
            if number != self.number {
                // A node that is gone, or takes nothing, hears nothing, as on a real bus.
                let _ = node.send(*frame);
            }
        }
        Ok(())
    }

    fn receive(&mut self, deadline: Instant) -> Result<Option<AnyFrame>, BusError> {
        // The bus itself holds the other end.
        self.received.wait(deadline).map_err(|Closed| BusError::Closed { name: "in-process bus".to_owned() })
    }
}
