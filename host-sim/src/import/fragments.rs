//! Datagrams that were sent as IP fragments, put together again (RFC 791, section 3.2).

use std::collections::HashSet;

use agv_core::measurement::Time;
use etherparse::defrag::IpDefragPool;
use etherparse::{LaxNetSlice, LaxSlicedPacket, SlicedPacket};

/// Fragments that wait for others for longer are given up, s.
const PATIENCE: f64 = 5.0;
/// Datagrams that wait at once, before the oldest are given up.
const MOST_WAITING: usize = 256;
/// Bytes of a header without options, which a datagram is given when it is whole.
const HEADER: usize = 20;

/// Puts fragments together.
pub(super) struct Fragments {
    pool: IpDefragPool<Time, ()>,
    /// Source, destination, number and protocol of those that wait.
    waiting: HashSet<([u8; 4], [u8; 4], u16, u8)>,
    /// Datagrams of which a fragment was never seen.
    lost: usize,
}

impl Fragments {
    pub(super) fn new() -> Self {
        Self { pool: IpDefragPool::new(), waiting: HashSet::new(), lost: 0 }
    }

    /// Takes a packet that may be a fragment; the whole datagram as a packet of its own, if it completes one.
    pub(super) fn take(&mut self, time: Time, packet: &LaxSlicedPacket<'_>) -> Option<Vec<u8>> {
        let Some(LaxNetSlice::Ipv4(ip)) = &packet.net else { return None };
        if !ip.header().is_fragmenting_payload() {
            return None;
        }
        let header = ip.header();
        let key = (header.source(), header.destination(), header.identification(), header.protocol().0);
        let fragment = [header.slice(), ip.payload().payload].concat();
        if self.waiting.len() >= MOST_WAITING {
            self.lost += self.waiting.len();
            self.waiting.clear();
            self.pool.retain(|_| false);
        }
        self.pool.retain(|before| time.since(*before) < PATIENCE);
        self.waiting.insert(key);
        // A fragment that was cut when it was captured is none.
        let whole = SlicedPacket::from_ip(&fragment)
            .ok()
            .and_then(|fragment| self.pool.process_sliced_packet(&fragment, time, ()).ok().flatten())?;
        self.waiting.remove(&key);
        let length = u16::try_from(HEADER + whole.payload.len()).ok()?;
        let mut bytes = header.slice().get(..HEADER)?.to_vec();
        // Version and length of the header, length of all, and no flags and no offset.
        bytes[0] = 0x45;
        bytes[2..4].copy_from_slice(&length.to_be_bytes());
        bytes[6..8].fill(0);
        bytes.extend_from_slice(&whole.payload);
        self.pool.return_buf(whole);
        Some(bytes)
    }

    /// Datagrams of which a fragment was never seen.
    pub(super) fn lost(&self) -> usize {
        self.lost + self.waiting.len()
    }
}
