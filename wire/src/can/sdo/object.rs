//! Objects of a node and their values.

/// An object, or a part of one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Object {
    /// Index.
    pub index: u16,
    /// Subindex; 0 for a simple object.
    pub sub: u8,
}

impl Object {
    /// The object at `index` and `sub`.
    #[must_use]
    pub const fn new(index: u16, sub: u8) -> Self {
        Self { index, sub }
    }
}

/// A value of one to four bytes, little-endian on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Value {
    pub(super) bytes: [u8; 4],
    pub(super) length: u8,
}

impl Value {
    /// The value in those bytes. None unless there are one to four.
    #[must_use]
    pub fn new(bytes: &[u8]) -> Option<Self> {
        if bytes.is_empty() {
            return None;
        }
        let mut four = [0; 4];
        four.get_mut(..bytes.len())?.copy_from_slice(bytes);
        Some(Self { bytes: four, length: bytes.len() as u8 })
    }

    /// The bytes.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.length)).unwrap_or_default()
    }

    /// The value as a number without sign.
    #[must_use]
    pub const fn unsigned(self) -> u32 {
        u32::from_le_bytes(self.bytes)
    }
}

impl From<u8> for Value {
    fn from(value: u8) -> Self {
        Self { bytes: [value, 0, 0, 0], length: 1 }
    }
}

impl From<u16> for Value {
    fn from(value: u16) -> Self {
        let [low, high] = value.to_le_bytes();
        Self { bytes: [low, high, 0, 0], length: 2 }
    }
}

impl From<u32> for Value {
    fn from(value: u32) -> Self {
        Self { bytes: value.to_le_bytes(), length: 4 }
    }
}
