//! What other nodes say on the vehicle's bus.

use agv_wire::can::canopen::NodeId;
use agv_wire::can::frame::{Frame, Id, extended_id, standard_id};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// What the identifiers of a node's messages begin with (CiA 301, 7.3.5).
const GROUPS: [u16; 12] = [0x080, 0x180, 0x200, 0x280, 0x300, 0x380, 0x400, 0x480, 0x500, 0x580, 0x600, 0x700];

/// Frames of nodes that a vehicle has nothing to do with, as like those of its own nodes as they can be: other nodes'
/// messages of every kind, the identifiers beside its own, its own ones with 29 bits or without data, and commands that
/// are for others or mean nothing. The same seed gives the same frames.
#[derive(Clone, Debug)]
pub struct ForeignTraffic {
    generator: ChaCha8Rng,
    own: Vec<NodeId>,
}

impl ForeignTraffic {
    /// Traffic beside the nodes `own`.
    #[must_use]
    pub fn new(seed: u64, own: &[NodeId]) -> Self {
        Self { generator: ChaCha8Rng::seed_from_u64(seed), own: own.to_vec() }
    }

    fn below(&mut self, end: u32) -> u32 {
        self.generator.next_u32() % end.max(1)
    }

    fn one_of(&mut self, values: &[u16]) -> u16 {
        let place = self.below(values.len() as u32) as usize;
        values.get(place).copied().unwrap_or_default()
    }

    fn is_own(&self, number: u16) -> bool {
        self.own.iter().any(|node| u16::from(node.number()) == number)
    }

    /// A node that is none of the own.
    fn other(&mut self) -> u16 {
        loop {
            let number = 1 + self.below(127) as u16;
            if !self.is_own(number) {
                return number;
            }
        }
    }

    /// An identifier of an own node, by its group and its node.
    fn own_identifier(&mut self) -> (u16, u16) {
        let place = self.below(self.own.len() as u32) as usize;
        let node = self.own.get(place).map_or(0, |node| u16::from(node.number()));
        (self.one_of(&GROUPS), node)
    }

    fn frame(&mut self, id: Id, length: usize) -> Frame {
        let data = self.generator.next_u64().to_le_bytes();
        Frame::new(id, data.get(..length).unwrap_or(&data)).unwrap_or(Frame::of(id, data))
    }

    /// A command for another node, or what is no command for an own one.
    fn command(&mut self) -> Frame {
        let command = self.one_of(&[0x01, 0x02, 0x80, 0x81, 0x82]) as u8;
        let (_, own) = self.own_identifier();
        let data = match self.below(3) {
            0 => [command, self.other() as u8],
            1 => [command, 0x80 | own as u8],
            _ => [0x03, own as u8],
        };
        Frame::of(standard_id(0), data)
    }

    /// The next frame.
    pub fn next_frame(&mut self) -> Frame {
        // Lengths that messages of the own nodes have, and any.
        let any = self.below(9) as usize;
        let length = match self.below(4) {
            0 => 4,
            1 => 8,
            2 => 1,
            _ => any,
        };
        match self.below(8) {
            0 => {
                let id = standard_id(self.one_of(&GROUPS) | self.other());
                self.frame(id, length)
            }
            1 => {
                let (group, node) = self.own_identifier();
                let beside = [node.wrapping_add(1), node.wrapping_sub(1)].into_iter().find(|node| !self.is_own(*node));
                self.frame(standard_id(group + beside.unwrap_or(0)), length)
            }
            2 => {
                let (group, node) = self.own_identifier();
                let number = u32::from(group | node);
                let id = match self.below(3) {
                    0 => number,
                    // On the bus the first eleven bits are those of the own node.
                    1 => number << 18,
                    _ => number << 18 | number,
                };
                self.frame(extended_id(id), length)
            }
            3 => {
                let (group, node) = self.own_identifier();
                let id = standard_id(group | node);
                Frame::remote(id, length).unwrap_or(Frame::of(id, []))
            }
            4 => self.command(),
            5 => {
                // Heartbeats and boot-up messages of other nodes.
                let state = self.one_of(&[0x00, 0x04, 0x05, 0x7F]) as u8;
                Frame::of(standard_id(0x700 | self.other()), [state])
            }
            6 => {
                // SYNC, the time of day, and identifiers that belong to no node.
                let id = standard_id(self.one_of(&[0x080, 0x100, 0x6FF, 0x7E4, 0x7E5, 0x7FF]));
                let length = if id == standard_id(0x080) { 0 } else { length };
                self.frame(id, length)
            }
            _ => {
                // More urgent than everything but commands.
                let id = standard_id(1 + self.below(0x7F) as u16);
                self.frame(id, length)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use agv_wire::can::canopen::{Message, NodeId};

    use super::*;

    #[test]
    fn nothing_of_it_is_of_an_own_node_or_for_one() {
        let own = [1, 2, 16].map(|number| NodeId::new(number).unwrap());
        let mut traffic = ForeignTraffic::new(1, &own);
        let (mut extended, mut remote, mut seen) = (0, 0, HashSet::new());
        for _ in 0..100_000 {
            let frame = traffic.next_frame();
            seen.insert(frame.id());
            extended += usize::from(matches!(frame.id(), Id::Extended(_)));
            remote += usize::from(frame.is_remote());
            let node = match Message::decode(&frame) {
                Ok(Message::Nmt { node, .. }) => Some(node.expect("a command to all is for the own nodes, too")),
                Ok(Message::Sync { .. }) | Err(_) => None,
                Ok(
                    Message::Emergency { node, .. }
                    | Message::TransmitPdo { node, .. }
                    | Message::ReceivePdo { node, .. }
                    | Message::SdoRequest { node, .. }
                    | Message::SdoResponse { node, .. }
                    | Message::Heartbeat { node, .. },
                ) => Some(node),
            };
            assert!(node.is_none_or(|node| !own.contains(&node)), "{frame:?}");
        }
        assert!(extended > 5000 && remote > 5000 && seen.len() > 1000, "{extended} {remote} {}", seen.len());
        for beside in [0x180, 0x183, 0x20F, 0x211, 0x60F, 0x703] {
            assert!(seen.contains(&standard_id(beside)), "{beside:X}");
        }
    }
}
