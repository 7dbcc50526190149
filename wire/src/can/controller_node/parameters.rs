//! Communication parameters: what a master may change of how the node speaks, and have stored (CiA 301, 7.5.2.13 "Store
//! parameters": all that can be stored).

use super::consumers::CONSUMERS;
use super::objects::TRANSMIT_PDOS;
use crate::can::pdo::MAX_ENTRIES;

/// Bytes of a PDO's parameters.
const PDO_BYTES: usize = 11 + 4 * MAX_ENTRIES;
/// Bytes of all parameters, as they are stored.
pub const PARAMETER_BYTES: usize = 7 + 4 * CONSUMERS + PDO_BYTES * TRANSMIT_PDOS;
/// What the bytes begin with: they mean something else in another version.
const VERSION: u8 = 1;

/// Of one PDO that is sent: 1800h and 1A00h, and those behind them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PdoParameters {
    /// Its identifier with its flags; the number 0 is that of the node by default.
    pub(super) id: u32,
    pub(super) transmission: u8,
    pub(super) inhibit: u16,
    /// None is the time between poses that is set.
    pub(super) timer: Option<u16>,
    pub(super) count: u8,
    pub(super) entries: [u32; MAX_ENTRIES],
}

/// What a master may change of how the node speaks.
///
/// Identifiers and times that are the default ones are known as such: another node number and another time between poses go on
/// to change them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CommunicationParameters {
    /// 1014h; the number 0 is that of the node by default.
    pub(super) emergency_id: u32,
    /// 1016h.
    pub(super) consumers: [u32; CONSUMERS],
    /// 1017h, ms.
    pub(super) heartbeat_time: u16,
    pub(super) pdos: [PdoParameters; TRANSMIT_PDOS],
}

/// Puts bytes behind each other; what has no room is left out, which [`PARAMETER_BYTES`] knows not to happen.
struct Writer<'a> {
    room: &'a mut [u8],
    place: usize,
}

impl Writer<'_> {
    fn put<const N: usize>(&mut self, bytes: [u8; N]) {
        let rest = self.room.get_mut(self.place..).unwrap_or_default();
        rest.iter_mut().zip(bytes).for_each(|(place, byte)| *place = byte);
        self.place += N;
    }
}

/// Takes bytes from the beginning.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (first, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*first)
    }

    fn byte(&mut self) -> Option<u8> {
        self.take().map(u8::from_le_bytes)
    }

    fn short(&mut self) -> Option<u16> {
        self.take().map(u16::from_le_bytes)
    }

    fn word(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }
}

impl CommunicationParameters {
    /// The bytes to store.
    #[must_use]
    pub fn encode(&self) -> [u8; PARAMETER_BYTES] {
        let mut bytes = [0; PARAMETER_BYTES];
        let mut writer = Writer { room: &mut bytes, place: 0 };
        writer.put([VERSION]);
        writer.put(self.emergency_id.to_le_bytes());
        self.consumers.iter().for_each(|entry| writer.put(entry.to_le_bytes()));
        writer.put(self.heartbeat_time.to_le_bytes());
        for pdo in &self.pdos {
            writer.put(pdo.id.to_le_bytes());
            writer.put([pdo.transmission, u8::from(pdo.timer.is_some()), pdo.count]);
            writer.put(pdo.inhibit.to_le_bytes());
            writer.put(pdo.timer.unwrap_or(0).to_le_bytes());
            pdo.entries.iter().for_each(|entry| writer.put(entry.to_le_bytes()));
        }
        bytes
    }

    /// What was stored. None if it is not [`PARAMETER_BYTES`] of this version; whether the values can be is known to the node that
    /// takes them.
    #[must_use]
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let mut reader = Reader(bytes);
        if reader.byte()? != VERSION || bytes.len() != PARAMETER_BYTES {
            return None;
        }
        let emergency_id = reader.word()?;
        let mut consumers = [0; CONSUMERS];
        for entry in &mut consumers {
            *entry = reader.word()?;
        }
        let heartbeat_time = reader.short()?;
        let mut pdos = [PdoParameters::OFF; TRANSMIT_PDOS];
        for pdo in &mut pdos {
            pdo.id = reader.word()?;
            let [transmission, has_timer, count] = reader.take()?;
            (pdo.transmission, pdo.count) = (transmission, count);
            pdo.inhibit = reader.short()?;
            let timer = reader.short()?;
            pdo.timer = (has_timer != 0).then_some(timer);
            for entry in &mut pdo.entries {
                *entry = reader.word()?;
            }
        }
        Some(Self { emergency_id, consumers, heartbeat_time, pdos })
    }
}

impl PdoParameters {
    /// Nothing is sent.
    pub(super) const OFF: Self =
        Self { id: 0, transmission: 0, inhibit: 0, timer: None, count: 0, entries: [0; MAX_ENTRIES] };
}
