//! A checked view of the bytes of a packet.

use super::Sensor;
use super::sensor::Layout;
use crate::packet::{Return, ReturnKind};

/// How a packet begins that has a header, and how a block begins of one that has none.
const START: [u8; 2] = [0xEE, 0xFF];
const BLOCK_START: [u8; 2] = [0xFF, 0xEE];
/// Bytes of the number that a packet may end with.
const NUMBER: usize = 4;
/// Hundredths of a degree in a turn.
const TURN: u16 = 36_000;

/// Why bytes are no packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "std", derive(thiserror::Error))]
pub enum PacketError {
    /// Length and beginning are those of none of the sensors.
    #[cfg_attr(feature = "std", error("{length} bytes that are no packet of a Pandar40P, PandarQT64 or XT32"))]
    Foreign {
        /// Bytes that were given.
        length: usize,
    },
    /// A rotation angle of more than a full turn.
    #[cfg_attr(feature = "std", error("block {block} states an angle of {found} hundredths of a degree"))]
    Azimuth {
        /// Number of the block, from 0.
        block: usize,
        /// What stands there, 0.01 degrees.
        found: u16,
    },
    /// A return mode that is none.
    #[cfg_attr(feature = "std", error("the packet states return mode {found:#04x}"))]
    ReturnMode {
        /// What stands there.
        found: u8,
    },
}

/// A checked packet.
#[derive(Clone, Copy)]
pub struct Packet<'a> {
    sensor: Sensor,
    bytes: &'a [u8],
    mode: u8,
}

impl<'a> Packet<'a> {
    /// Checks the bytes of a packet.
    ///
    /// # Errors
    /// See [`PacketError`].
    pub fn new(bytes: &'a [u8]) -> Result<Self, PacketError> {
        let foreign = PacketError::Foreign { length: bytes.len() };
        let sensor = Sensor::ALL.into_iter().find(|sensor| is_of(*sensor, bytes)).ok_or(foreign)?;
        let layout = sensor.layout();
        let tail = layout.header + layout.blocks * block_length(sensor);
        let mode = bytes.get(tail + layout.return_mode).copied().ok_or(foreign)?;
        if kinds(sensor, mode).is_none() {
            return Err(PacketError::ReturnMode { found: mode });
        }
        let packet = Self { sensor, bytes, mode };
        for block in 0..layout.blocks {
            match packet.stated_azimuth(block) {
                Some(found) if found > TURN => return Err(PacketError::Azimuth { block, found }),
                _ => {}
            }
        }
        Ok(packet)
    }

    /// The sensor that sends such packets.
    #[must_use]
    pub fn sensor(&self) -> Sensor {
        self.sensor
    }

    /// Which returns of a firing the packet holds, block by block in turn: one, or two.
    #[must_use]
    pub fn kinds(&self) -> (ReturnKind, Option<ReturnKind>) {
        kinds(self.sensor, self.mode).unwrap_or((ReturnKind::Unknown, None))
    }

    /// Number of blocks.
    #[must_use]
    pub fn blocks(&self) -> usize {
        self.sensor.layout().blocks
    }

    /// Rotation angle of the head at a block, 0.01 degrees, 0 to 35999.
    #[must_use]
    pub fn azimuth(&self, block: usize) -> Option<u16> {
        self.stated_azimuth(block).map(|azimuth| azimuth % TURN)
    }

    /// A return of a block, counts of [`Self::distance_resolution`].
    #[must_use]
    pub fn one(&self, block: usize, laser: usize) -> Option<Return> {
        let Layout { header, block_header, unit, .. } = self.sensor.layout();
        let at = header + block * block_length(self.sensor) + block_header + laser * unit;
        let [low, high, intensity] = *self.bytes.get(at..)?.first_chunk()?;
        Some(Return { distance: u16::from_le_bytes([low, high]), intensity })
    }

    /// Length of one count of distance, m: the packet states it, and for a Pandar40P the manual.
    #[must_use]
    pub fn distance_resolution(&self) -> f32 {
        const UNIT: usize = 9;
        let millimetres = match self.sensor {
            Sensor::Pandar40p => 4,
            Sensor::PandarQt64 | Sensor::PandarXt32 => self.bytes.get(UNIT).copied().unwrap_or(0),
        };
        0.001 * f32::from(millimetres)
    }

    /// Microseconds of the second of the packet's time.
    #[must_use]
    pub fn micros(&self) -> Option<u32> {
        let at = self.tail() + self.sensor.layout().micros;
        Some(u32::from_le_bytes(*self.bytes.get(at..)?.first_chunk()?))
    }

    /// Year (of the century), month, day, hour, minute and second of the packet's time, as the sensor counts them.
    #[must_use]
    pub fn date(&self) -> Option<[u8; 6]> {
        self.bytes.get(self.tail() + self.sensor.layout().date..)?.first_chunk().copied()
    }

    fn tail(&self) -> usize {
        let layout = self.sensor.layout();
        layout.header + layout.blocks * block_length(self.sensor)
    }

    fn stated_azimuth(&self, block: usize) -> Option<u16> {
        let Layout { header, block_header, .. } = self.sensor.layout();
        let at = header + block * block_length(self.sensor) + block_header - 2;
        Some(u16::from_le_bytes(*self.bytes.get(at..)?.first_chunk()?))
    }
}

fn block_length(sensor: Sensor) -> usize {
    let Layout { block_header, unit, .. } = sensor.layout();
    block_header + sensor.lasers() * unit
}

/// Whether length and beginning are those of a sensor.
fn is_of(sensor: Sensor, bytes: &[u8]) -> bool {
    const COUNTS: usize = 6;
    let Layout { header, blocks, tail, .. } = sensor.layout();
    let length = header + blocks * block_length(sensor) + tail;
    if bytes.len() != length && bytes.len() != length + NUMBER {
        return false;
    }
    if header == 0 {
        return bytes.chunks(block_length(sensor)).take(blocks).all(|block| block.starts_with(&BLOCK_START));
    }
    let counts = [sensor.lasers() as u8, blocks as u8];
    bytes.starts_with(&START) && bytes.get(COUNTS..).is_some_and(|rest| rest.starts_with(&counts))
}

/// The returns of a mode (manuals); None for a mode that is none.
fn kinds(sensor: Sensor, mode: u8) -> Option<(ReturnKind, Option<ReturnKind>)> {
    use ReturnKind::{First, Last, Second, Strongest};
    Some(match mode {
        0x33 => (First, None),
        0x34 => (Second, None),
        0x37 => (Strongest, None),
        0x38 => (Last, None),
        0x39 => (Last, Some(Strongest)),
        0x3A => (First, Some(Second)),
        0x3B if sensor == Sensor::PandarXt32 => (Last, Some(First)),
        0x3B => (First, Some(Last)),
        0x3C => (First, Some(Strongest)),
        _ => return None,
    })
}
