//! Channels of a scan.

use super::{DeviceTime, Milliangle};
use crate::cola::{Element, ReadError, Reader, Sequence, WriteError, Writer};

/// What the numbers of a channel are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChannelName(pub [u8; 5]);

impl ChannelName {
    /// Distances, mm.
    pub const DISTANCE: Self = Self(*b"DIST1");
    /// Directions, 1/10000 degree.
    pub const ANGLE: Self = Self(*b"ANGL1");
    /// Strength of echoes.
    pub const REMISSION: Self = Self(*b"RSSI1");
}

/// One number for each beam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Channel<'a, T: Element> {
    /// What the numbers are.
    pub name: ChannelName,
    /// Factor of the numbers.
    pub scale: f32,
    /// What is added to the numbers after the factor.
    pub offset: f32,
    /// Direction of the first beam.
    pub first: Milliangle,
    /// Angle between beams, thousandths of a degree.
    pub resolution: u16,
    /// When the first beam was measured.
    pub start: DeviceTime,
    /// The numbers.
    pub samples: Sequence<'a, T>,
}

impl<'a, T: Element> Channel<'a, T> {
    pub(super) fn read(reader: &mut Reader<'a>) -> Result<Self, ReadError> {
        let name = ChannelName(reader.word()?);
        let (scale, offset) = (reader.f32()?, reader.f32()?);
        let (first, resolution) = (Milliangle(reader.i32()?), reader.u16()?);
        let start = DeviceTime(reader.u32()?);
        let count = usize::from(reader.u16()?);
        Ok(Self { name, scale, offset, first, resolution, start, samples: Sequence::read(reader, count)? })
    }

    pub(super) fn write(&self, writer: &mut Writer) -> Result<(), WriteError> {
        writer.word(&self.name.0)?;
        writer.f32(self.scale)?;
        writer.f32(self.offset)?;
        writer.i32(self.first.0)?;
        writer.u16(self.resolution)?;
        writer.u32(self.start.0)?;
        writer.count(self.samples.len())?;
        self.samples.write(writer)
    }
}

impl Channel<'_, u32> {
    /// Writes the distances, m, to the beginning of `ranges`; returns their number, or None if there are more than
    /// `ranges` has room for.
    pub fn copy_metres(&self, ranges: &mut [f32]) -> Option<usize> {
        let count = self.samples.len();
        let ranges = ranges.get_mut(..count)?;
        let metres = |raw: u32| (raw as f32 * self.scale + self.offset) * 1e-3;
        if let Some(bytes) = self.samples.binary_bytes() {
            for (range, raw) in ranges.iter_mut().zip(bytes.as_chunks::<4>().0) {
                *range = metres(u32::from_be_bytes(*raw));
            }
        } else {
            for (range, raw) in ranges.iter_mut().zip(self.samples.iter()) {
                *range = metres(raw);
            }
        }
        Some(count)
    }
}

impl Channel<'_, u16> {
    /// Writes the numbers as they are to the beginning of `values`; returns how many, or None if there are more than
    /// `values` has room for.
    pub fn copy(&self, values: &mut [u16]) -> Option<usize> {
        let count = self.samples.len();
        let values = values.get_mut(..count)?;
        if let Some(bytes) = self.samples.binary_bytes() {
            for (value, raw) in values.iter_mut().zip(bytes.as_chunks::<2>().0) {
                *value = u16::from_be_bytes(*raw);
            }
        } else {
            for (value, raw) in values.iter_mut().zip(self.samples.iter()) {
                *value = raw;
            }
        }
        Some(count)
    }
}
