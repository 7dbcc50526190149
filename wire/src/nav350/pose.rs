//! Poses as the sensor reports them.

use super::{Angle, Coordinate, DeviceTime};
use crate::cola::{ReadError, Reader, WriteError, Writer};

/// What a pose rests on. Only [`Continuous`](Self::Continuous) can be trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PositionMode {
    /// The first pose is being looked for.
    Initial,
    /// Reflectors.
    Continuous,
    /// Reflectors and speeds, with few reflectors.
    Virtual,
    /// Positioning has stopped.
    Stopped,
    /// The pose is not valid.
    Invalid,
    /// A pose from outside.
    External,
    /// A number without a known meaning.
    Other(u8),
}

impl PositionMode {
    /// The mode of that number.
    #[must_use]
    pub const fn from_number(number: u8) -> Self {
        match number {
            0 => Self::Initial,
            1 => Self::Continuous,
            2 => Self::Virtual,
            3 => Self::Stopped,
            4 => Self::Invalid,
            5 => Self::External,
            _ => Self::Other(number),
        }
    }

    /// The mode's number.
    #[must_use]
    pub const fn number(self) -> u8 {
        match self {
            Self::Initial => 0,
            Self::Continuous => 1,
            Self::Virtual => 2,
            Self::Stopped => 3,
            Self::Invalid => 4,
            Self::External => 5,
            Self::Other(number) => number,
        }
    }
}

/// What a pose rests on, and when it is true.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PoseDetails {
    /// 1 if the pose is carried forward to the time of output.
    pub output_mode: u8,
    /// When the pose is true.
    pub time: DeviceTime,
    /// Mean deviation of the reflectors, mm.
    pub mean_deviation: i32,
    /// What the pose rests on.
    pub mode: PositionMode,
    /// Bits without a verified meaning.
    pub info: u32,
    /// Number of reflectors that were used.
    pub used_reflectors: u8,
}

/// A pose of the sensor in its layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PoseReport {
    /// Position.
    pub x: Coordinate,
    /// Position.
    pub y: Coordinate,
    /// Heading.
    pub heading: Angle,
    /// Details, if the format asks for them.
    pub details: Option<PoseDetails>,
}

impl PoseReport {
    pub(super) fn read(reader: &mut Reader) -> Result<Self, ReadError> {
        Ok(Self {
            x: Coordinate(reader.i32()?),
            y: Coordinate(reader.i32()?),
            heading: Angle(reader.u32()?),
            details: if reader.u16()? == 0 {
                None
            } else {
                Some(PoseDetails {
                    output_mode: reader.u8()?,
                    time: DeviceTime(reader.u32()?),
                    mean_deviation: reader.i32()?,
                    mode: PositionMode::from_number(reader.u8()?),
                    info: reader.u32()?,
                    used_reflectors: reader.u8()?,
                })
            },
        })
    }

    pub(super) fn write(&self, writer: &mut Writer) -> Result<(), WriteError> {
        writer.i32(self.x.0)?;
        writer.i32(self.y.0)?;
        writer.u32(self.heading.0)?;
        writer.u16(self.details.is_some().into())?;
        let Some(details) = &self.details else { return Ok(()) };
        writer.u8(details.output_mode)?;
        writer.u32(details.time.0)?;
        writer.i32(details.mean_deviation)?;
        writer.u8(details.mode.number())?;
        writer.u32(details.info)?;
        writer.u8(details.used_reflectors)
    }
}
