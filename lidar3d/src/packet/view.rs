//! A checked view of the 1206 bytes that a Velodyne sends.

use super::status::{ReturnMode, Tail};

/// UDP port to which the sensors send.
pub const PORT: u16 = 2368;
/// Bytes of a packet.
pub const LENGTH: usize = 1206;
/// Blocks in a packet.
pub const BLOCKS: usize = 12;
/// Returns in a block.
pub const RETURNS: usize = 32;

const BLOCK_LENGTH: usize = 100;
/// How a block begins, by the bank of 32 lasers that it is of.
const BANKS: [u16; 4] = [0xEEFF, 0xDDFF, 0xCCFF, 0xBBFF];
/// Blocks that a VLS-128 uses when it sends two returns; the last four are empty.
const DUAL_BLOCKS: usize = 8;
const VLS128: u8 = 0xA1;
/// Hundredths of a degree in a turn.
const TURN: u16 = 36_000;

/// The turn of the head from one azimuth to another, both of at most one turn, 0.01 degrees.
#[must_use]
pub fn counts_between(first: u16, last: u16) -> u16 {
    let turned = u32::from(last) + u32::from(TURN) - u32::from(first % TURN);
    (turned % u32::from(TURN)) as u16
}

/// Why bytes are no packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "std", derive(thiserror::Error))]
pub enum PacketError {
    /// The length is not [`LENGTH`].
    #[cfg_attr(feature = "std", error("a packet has 1206 bytes, this one {length}"))]
    Length {
        /// Bytes that were given.
        length: usize,
    },
    /// A block begins with none of the four identifiers.
    #[cfg_attr(feature = "std", error("block {block} begins with {found:#06x}, which is no bank of lasers"))]
    Identifier {
        /// Number of the block, from 0.
        block: usize,
        /// What stands there.
        found: u16,
    },
    /// A rotation angle of more than a full turn.
    #[cfg_attr(feature = "std", error("block {block} states an angle of {found} hundredths of a degree"))]
    Azimuth {
        /// Number of the block, from 0.
        block: usize,
        /// What stands there, 0.01 degrees.
        found: u16,
    },
}

/// One return.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Return {
    /// Distance in counts of the sensor; 0 if there is none.
    pub distance: u16,
    /// Intensity.
    pub intensity: u8,
}

/// One block of a packet.
#[derive(Clone, Copy)]
pub struct Block<'a> {
    bytes: &'a [u8; BLOCK_LENGTH],
}

impl<'a> Block<'a> {
    /// Which bank of 32 lasers the returns are of, from 0: an HDL-64E has two (0 the upper one), a VLS-128 four.
    #[must_use]
    pub fn bank(&self) -> usize {
        let identifier = u16::from_le_bytes([self.bytes[0], self.bytes[1]]);
        BANKS.iter().position(|bank| *bank == identifier).unwrap_or(0)
    }

    /// Rotation angle of the head, 0.01 degrees, 0 to 35999. Sensors state a full turn now and then, which is zero.
    #[must_use]
    pub fn azimuth(&self) -> u16 {
        u16::from_le_bytes([self.bytes[2], self.bytes[3]]) % TURN
    }

    /// The return at a place.
    pub(super) fn one(&self, place: usize) -> Option<Return> {
        let [low, high, intensity] = *self.bytes[4..].as_chunks::<3>().0.get(place)?;
        Some(Return { distance: u16::from_le_bytes([low, high]), intensity })
    }

    /// The returns in the order in which they stand.
    pub fn returns(&self) -> impl Iterator<Item = Return> + use<'a> {
        let (triples, _) = self.bytes[4..].as_chunks::<3>();
        triples
            .iter()
            .map(|[low, high, intensity]| Return { distance: u16::from_le_bytes([*low, *high]), intensity: *intensity })
    }
}

/// A checked packet.
#[derive(Clone, Copy)]
pub struct Packet<'a> {
    blocks: &'a [[u8; BLOCK_LENGTH]],
    /// Blocks that hold returns.
    used: usize,
    tail: [u8; 6],
}

impl<'a> Packet<'a> {
    /// Checks the bytes of a packet.
    ///
    /// # Errors
    /// See [`PacketError`].
    pub fn new(bytes: &'a [u8]) -> Result<Self, PacketError> {
        let length = PacketError::Length { length: bytes.len() };
        if bytes.len() != LENGTH {
            return Err(length);
        }
        let (body, tail) = bytes.split_last_chunk::<6>().ok_or(length)?;
        let (blocks, _) = body.as_chunks::<BLOCK_LENGTH>();
        let is_short = Tail(*tail).return_mode() == Some(ReturnMode::Dual) && tail[5] == VLS128;
        let used = if is_short { DUAL_BLOCKS } else { BLOCKS };
        for (index, bytes) in blocks.iter().take(used).enumerate() {
            let identifier = u16::from_le_bytes([bytes[0], bytes[1]]);
            if !BANKS.contains(&identifier) {
                return Err(PacketError::Identifier { block: index, found: identifier });
            }
            let found = u16::from_le_bytes([bytes[2], bytes[3]]);
            if found > TURN {
                return Err(PacketError::Azimuth { block: index, found });
            }
        }
        Ok(Self { blocks, used, tail: *tail })
    }

    /// The blocks that hold returns: [`BLOCKS`] of them, and eight if a VLS-128 sends two returns.
    pub fn blocks(&self) -> impl Iterator<Item = Block<'a>> + use<'a> {
        self.blocks.iter().take(self.used).map(|bytes| Block { bytes })
    }

    /// One of those blocks.
    pub(super) fn block(&self, block: usize) -> Option<Block<'a>> {
        self.blocks.get(block).filter(|_| block < self.used).map(|bytes| Block { bytes })
    }

    /// The bytes themselves.
    #[must_use]
    pub fn bytes(&self) -> [u8; LENGTH] {
        let mut bytes = [0; LENGTH];
        for (target, block) in bytes.as_chunks_mut::<BLOCK_LENGTH>().0.iter_mut().zip(self.blocks) {
            *target = *block;
        }
        bytes[LENGTH - 6..].copy_from_slice(&self.tail);
        bytes
    }

    /// Rotation angle of a block, 0.01 degrees.
    pub(super) fn azimuth(&self, block: usize) -> Option<u16> {
        self.block(block).map(|block| block.azimuth())
    }

    /// The six bytes behind the blocks.
    #[must_use]
    pub fn tail(&self) -> Tail {
        Tail(self.tail)
    }

    /// Writes a packet: for each block whether it is of the lower lasers of an HDL-64E, its angle in 0.01 degrees, and its returns.
    #[must_use]
    pub fn write(blocks: &[(bool, u16, [Return; RETURNS]); BLOCKS], tail: Tail) -> [u8; LENGTH] {
        let mut bytes = [0; LENGTH];
        for (target, (is_lower, azimuth, returns)) in bytes.as_chunks_mut::<BLOCK_LENGTH>().0.iter_mut().zip(blocks) {
            target[..2].copy_from_slice(&BANKS[usize::from(*is_lower)].to_le_bytes());
            target[2..4].copy_from_slice(&azimuth.to_le_bytes());
            for (target, value) in target[4..].as_chunks_mut::<3>().0.iter_mut().zip(returns) {
                target[..2].copy_from_slice(&value.distance.to_le_bytes());
                target[2] = value.intensity;
            }
        }
        bytes[LENGTH - 6..].copy_from_slice(&tail.0);
        bytes
    }
}
