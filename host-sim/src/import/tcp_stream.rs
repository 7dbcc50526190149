//! One direction of a TCP connection, put together from its segments (RFC 9293, section 3.4).

use std::collections::BTreeMap;

/// Bytes that wait for an earlier segment before that segment is given up.
const PATIENCE: usize = 1 << 18;

/// Puts segments in order.
#[derive(Clone, Debug, Default)]
pub struct TcpStream {
    /// Sequence number of the next byte, once a segment was seen.
    next: Option<u32>,
    /// Segments that came too early, by how far their first byte lies ahead of `base`.
    early: BTreeMap<u64, Vec<u8>>,
    /// How many bytes have been delivered, so that keys of `early` never wrap.
    delivered: u64,
    lost: u64,
}

impl TcpStream {
    /// A direction of which nothing was seen.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// How many bytes are missing because their segments were never seen.
    #[must_use]
    pub const fn lost(&self) -> u64 {
        self.lost
    }

    /// A connection begins: the first byte has the number after that of its SYN.
    pub fn synchronise(&mut self, sequence: u32) {
        *self = Self { next: Some(sequence.wrapping_add(1)), lost: self.lost, ..Self::default() };
    }

    /// Takes a segment, gives the bytes that are in order now. A capture may begin in the middle of a connection: the
    /// first segment is then the beginning.
    pub fn segment(&mut self, sequence: u32, bytes: &[u8]) -> Vec<u8> {
        if bytes.is_empty() {
            return Vec::new();
        }
        let next = *self.next.get_or_insert(sequence);
        // Sequence numbers wrap: the difference is what counts.
        let ahead = i64::from(sequence.wrapping_sub(next).cast_signed());
        let start = self.delivered.cast_signed() + ahead;
        let known = usize::try_from(-ahead).unwrap_or(0);
        if let Some(new) = bytes.get(known..).filter(|new| !new.is_empty()) {
            let key = u64::try_from(start).unwrap_or(0).max(self.delivered);
            let place = self.early.entry(key).or_default();
            if place.len() < new.len() {
                *place = new.to_vec();
            }
        }
        let mut ready = self.take_ready();
        let waiting: usize = self.early.values().map(Vec::len).sum();
        if waiting > PATIENCE {
            ready.extend(self.give_up());
        }
        ready
    }

    /// The bytes that still wait, without what is missing before them.
    pub fn finish(&mut self) -> Vec<u8> {
        let mut rest = Vec::new();
        while !self.early.is_empty() {
            rest.extend(self.give_up());
        }
        rest
    }

    fn give_up(&mut self) -> Vec<u8> {
        let Some((&start, _)) = self.early.first_key_value() else { return Vec::new() };
        self.lost += start - self.delivered;
        self.advance(start - self.delivered);
        self.take_ready()
    }

    fn advance(&mut self, count: u64) {
        self.delivered += count;
        self.next = self.next.map(|next| next.wrapping_add(count as u32));
    }

    fn take_ready(&mut self) -> Vec<u8> {
        let mut ready = Vec::new();
        while let Some(entry) = self.early.first_entry().filter(|entry| *entry.key() <= self.delivered) {
            let known = (self.delivered - entry.key()) as usize;
            let bytes = entry.remove();
            if let Some(new) = bytes.get(known..) {
                ready.extend_from_slice(new);
                self.advance(new.len() as u64);
            }
        }
        ready
    }
}
