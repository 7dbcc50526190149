//! Process data: which objects stand where in a PDO (CiA 301, 7.5.2.36).

use heapless::Vec;

use super::sdo::Object;

/// Most objects that one PDO can hold, if each has at least a byte.
pub const MAX_ENTRIES: usize = 8;

/// One object in a PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MappingEntry {
    /// The object.
    pub object: Object,
    /// Its length in the PDO, bits.
    pub bits: u8,
}

impl MappingEntry {
    /// The entry in an object's value, as in 1A00h: index, subindex, length.
    #[must_use]
    pub const fn decode(value: u32) -> Self {
        let [bits, sub, low, high] = value.to_le_bytes();
        Self { object: Object::new(u16::from_le_bytes([low, high]), sub), bits }
    }

    /// The entry as an object's value.
    #[must_use]
    pub const fn encode(&self) -> u32 {
        let [low, high] = self.object.index.to_le_bytes();
        u32::from_le_bytes([self.bits, self.object.sub, low, high])
    }
}

/// The objects of a PDO in their order, from the lowest bit of the first byte.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PdoMapping {
    entries: Vec<MappingEntry, MAX_ENTRIES>,
}

impl PdoMapping {
    /// A mapping without objects.
    #[must_use]
    pub const fn new() -> Self {
        Self { entries: Vec::new() }
    }

    /// Adds an object behind the others. False if there is no room for it in eight bytes.
    pub fn push(&mut self, entry: MappingEntry) -> bool {
        let used: u32 = self.entries.iter().map(|entry| u32::from(entry.bits)).sum();
        used + u32::from(entry.bits) <= 64 && self.entries.push(entry).is_ok()
    }

    /// The objects.
    #[must_use]
    pub fn entries(&self) -> &[MappingEntry] {
        &self.entries
    }

    /// Whether the PDO holds that object.
    #[must_use]
    pub fn contains(&self, object: Object) -> bool {
        self.entries.iter().any(|entry| entry.object == object)
    }

    /// The bits of an object in a PDO's data, without sign. None if it is not mapped, or the data are too short for it.
    #[must_use]
    pub fn extract(&self, object: Object, data: &[u8]) -> Option<u64> {
        let mut first = 0;
        for entry in &self.entries {
            let bits = u32::from(entry.bits);
            if entry.object == object && bits > 0 {
                return extract_bits(data, first, bits);
            }
            first += bits;
        }
        None
    }
}

fn extract_bits(data: &[u8], first: u32, bits: u32) -> Option<u64> {
    if first + bits > 8 * data.len().min(8) as u32 {
        return None;
    }
    let mut bytes = [0; 8];
    for (to, from) in bytes.iter_mut().zip(data) {
        *to = *from;
    }
    Some((u64::from_le_bytes(bytes) >> first) & (u64::MAX >> (64 - bits)))
}
