//! Heartbeats of other nodes that are watched (CiA 301, 7.2.8.3.2.2 and 7.5.2.18).

use agv_core::measurement::Time;
use heapless::Vec;

use crate::can::canopen::NodeId;
use crate::can::nmt::NmtState;
use crate::can::sdo::AbortCode;

/// Most nodes that are watched.
pub const CONSUMERS: usize = 4;

#[derive(Clone, Copy, Debug, Default)]
struct Consumer {
    /// As in 1016h: time in ms, and the node above it.
    entry: u32,
    /// When the node was heard last; a watch begins with the first heartbeat.
    heard: Option<Time>,
}

impl Consumer {
    /// The node, if one is watched, and how long it may be silent, s.
    fn watched(&self) -> Option<(NodeId, f64)> {
        let [low, high, node, _] = self.entry.to_le_bytes();
        let longest = u16::from_le_bytes([low, high]);
        NodeId::new(node).filter(|_| longest > 0).map(|node| (node, 1e-3 * f64::from(longest)))
    }
}

/// All watches.
#[derive(Clone, Copy, Debug)]
pub(super) struct Consumers([Consumer; CONSUMERS]);

impl Consumers {
    pub(super) const fn new() -> Self {
        Self([Consumer { entry: 0, heard: None }; CONSUMERS])
    }

    /// An entry, from 1 on.
    pub(super) fn entry(&self, sub: u8) -> Option<u32> {
        self.0.get(usize::from(sub.checked_sub(1)?)).map(|consumer| consumer.entry)
    }

    /// All entries.
    pub(super) fn entries(&self) -> [u32; CONSUMERS] {
        self.0.map(|consumer| consumer.entry)
    }

    /// Changes an entry, from 1 on. The same node cannot be watched twice.
    pub(super) fn set(&mut self, sub: u8, entry: u32) -> Result<(), AbortCode> {
        let place = usize::from(sub.wrapping_sub(1));
        let consumer = Consumer { entry, heard: None };
        let is_same = |other: &Consumer| match (consumer.watched(), other.watched()) {
            (Some((one, _)), Some((other, _))) => one == other,
            _ => false,
        };
        if self.0.iter().enumerate().any(|(other, known)| other != place && is_same(known)) {
            return Err(AbortCode::ParameterIncompatible);
        }
        let [_, _, node, reserved] = entry.to_le_bytes();
        if reserved != 0 || node > 127 {
            return Err(AbortCode::InvalidValue);
        }
        *self.0.get_mut(place).ok_or(AbortCode::NoSuchSubindex)? = consumer;
        Ok(())
    }

    /// A node says its state. Its boot-up message is no promise of heartbeats.
    pub(super) fn hear(&mut self, node: NodeId, state: NmtState, now: Time) {
        for consumer in &mut self.0 {
            if consumer.watched().is_some_and(|(watched, _)| watched == node) {
                consumer.heard = (state != NmtState::BootUp).then_some(now);
            }
        }
    }

    /// Whether a node was heard and is silent for too long.
    pub(super) fn is_any_lost(&self, now: Time) -> bool {
        self.0.iter().any(|consumer| match (consumer.watched(), consumer.heard) {
            (Some((_, longest)), Some(heard)) => now.since(heard) > longest,
            _ => false,
        })
    }

    /// The nodes that are watched.
    pub(super) fn nodes(&self) -> Vec<NodeId, CONSUMERS> {
        let mut nodes = Vec::new();
        for (node, _) in self.0.iter().filter_map(Consumer::watched) {
            // There is room for all.
            let _ = nodes.push(node);
        }
        nodes
    }
}
