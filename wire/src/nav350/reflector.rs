//! Reflectors as the sensor reports them.

use super::{Angle, Coordinate, DeviceTime, Distance, Size};
use crate::cola::{Element, ReadError, Reader, Sequence, WriteError, Writer};

/// Time, identity and quality of a reflector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReflectorDetails {
    /// Name in this revolution.
    pub local_id: u16,
    /// Name in the layout, 65535 if it is not known there.
    pub global_id: u16,
    /// What it is; 1 is a reflector.
    pub kind: u8,
    /// Its shape; 1 flat, 2 cylindrical.
    pub subtype: u16,
    /// Quality, percent.
    pub quality: u16,
    /// When it was seen.
    pub time: DeviceTime,
    /// Width or diameter.
    pub size: Size,
    /// Number of beams that hit it.
    pub hit_count: u16,
    /// Mean strength of the echoes.
    pub mean_echo: u16,
    /// First beam that hit it.
    pub start_index: u16,
    /// Last beam that hit it. Below the first one if the reflector lies across the end of the revolution; that sensors
    /// report it so is not verified.
    pub end_index: u16,
}

impl ReflectorDetails {
    /// Number of beams from the first to the last that hit it, in a revolution of `beams` beams.
    #[must_use]
    pub const fn span(&self, beams: u16) -> u16 {
        let past_the_end = if self.end_index < self.start_index { beams } else { 0 };
        self.end_index.wrapping_sub(self.start_index).wrapping_add(past_the_end).wrapping_add(1)
    }
}

/// A reflector, seen from the sensor. Each part is there or not, whatever format was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reflector {
    /// Place along the sensor's axes.
    pub cartesian: Option<(Coordinate, Coordinate)>,
    /// Place as distance and direction.
    pub polar: Option<(Distance, Angle)>,
    /// Time, identity and quality.
    pub details: Option<ReflectorDetails>,
}

impl Element for Reflector {
    fn read(reader: &mut Reader) -> Result<Self, ReadError> {
        let cartesian = match reader.u16()? {
            0 => None,
            _ => Some((Coordinate(reader.i32()?), Coordinate(reader.i32()?))),
        };
        let polar = match reader.u16()? {
            0 => None,
            _ => Some((Distance(reader.u32()?), Angle(reader.u32()?))),
        };
        let details = match reader.u16()? {
            0 => None,
            _ => Some(ReflectorDetails {
                local_id: reader.u16()?,
                global_id: reader.u16()?,
                kind: reader.u8()?,
                subtype: reader.u16()?,
                quality: reader.u16()?,
                time: DeviceTime(reader.u32()?),
                size: Size(reader.u16()?),
                hit_count: reader.u16()?,
                mean_echo: reader.u16()?,
                start_index: reader.u16()?,
                end_index: reader.u16()?,
            }),
        };
        Ok(Self { cartesian, polar, details })
    }

    fn write(&self, writer: &mut Writer) -> Result<(), WriteError> {
        writer.u16(self.cartesian.is_some().into())?;
        if let Some((x, y)) = self.cartesian {
            writer.i32(x.0)?;
            writer.i32(y.0)?;
        }
        writer.u16(self.polar.is_some().into())?;
        if let Some((distance, direction)) = self.polar {
            writer.u32(distance.0)?;
            writer.u32(direction.0)?;
        }
        writer.u16(self.details.is_some().into())?;
        let Some(details) = &self.details else { return Ok(()) };
        writer.u16(details.local_id)?;
        writer.u16(details.global_id)?;
        writer.u8(details.kind)?;
        writer.u16(details.subtype)?;
        writer.u16(details.quality)?;
        writer.u32(details.time.0)?;
        writer.u16(details.size.0)?;
        writer.u16(details.hit_count)?;
        writer.u16(details.mean_echo)?;
        writer.u16(details.start_index)?;
        writer.u16(details.end_index)
    }
}

/// The reflectors of one revolution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReflectorList<'a> {
    /// Which reflectors are reported, as [`LandmarkDataFormat`](super::LandmarkDataFormat) asks.
    pub filter: u8,
    /// The reflectors.
    pub reflectors: Sequence<'a, Reflector>,
}

impl<'a> ReflectorList<'a> {
    /// The list behind a flag, or none.
    pub(super) fn read(reader: &mut Reader<'a>) -> Result<Option<Self>, ReadError> {
        if reader.u16()? == 0 {
            return Ok(None);
        }
        let filter = reader.u8()?;
        let count = usize::from(reader.u16()?);
        Ok(Some(Self { filter, reflectors: Sequence::read(reader, count)? }))
    }

    pub(super) fn write(list: Option<&Self>, writer: &mut Writer) -> Result<(), WriteError> {
        writer.u16(list.is_some().into())?;
        let Some(list) = list else { return Ok(()) };
        writer.u8(list.filter)?;
        writer.count(list.reflectors.len())?;
        list.reflectors.write(writer)
    }
}
