//! Variables that can be written, with their values.

use super::{Coordinate, Distance, Milliangle, Size, Variable};
use crate::cola::{Dialect, Raw, ReadError, Reader, WriteError, Writer};

/// What a pose says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PoseDataFormat {
    /// Whether the pose is carried forward to the time of output with the last speed, instead of as it was measured.
    pub is_extrapolated: bool,
    /// Whether time, mode and quality come with it.
    pub has_details: bool,
}

/// How the place of a reflector is said.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CoordinateFormat {
    /// Along the axes of the sensor.
    Cartesian,
    /// As distance and direction.
    Polar,
}

/// What reflectors say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LandmarkDataFormat {
    /// How places are said.
    pub coordinates: CoordinateFormat,
    /// Whether time, identity and quality come with each.
    pub has_details: bool,
    /// Which reflectors are reported; 0 those that the sensor uses, 1 all. The meaning is not verified.
    pub filter: u8,
}

/// What a scan holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScanDataFormat {
    /// Which channels; 1 is distances. Other numbers are not verified.
    pub channels: u8,
    /// Whether the strength of echoes comes with it.
    pub has_remission: bool,
}

/// How mapping is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MapConfiguration {
    /// Number of revolutions that are averaged, 1 to 127.
    pub mean: u8,
    /// Whether only reflectors are reported that the layout does not have.
    pub only_unknown: bool,
    /// Position of the sensor in the layout.
    pub x: Coordinate,
    /// Position of the sensor in the layout.
    pub y: Coordinate,
    /// Heading of the sensor in the layout.
    pub heading: Milliangle,
}

/// Shape of reflectors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReflectorType {
    /// A plate.
    Flat,
    /// A cylinder.
    Cylindrical,
}

/// How far from its expected place a reflector may be seen. What the two windows stand for is not verified.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IdentificationWindow {
    /// Window at the lower distance, mm.
    pub low: Size,
    /// Window at the higher distance, mm.
    pub high: Size,
    /// Lower distance.
    pub low_distance: Distance,
    /// Higher distance.
    pub high_distance: Distance,
}

/// A variable with a value to write, or as it was read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Setting<'a> {
    /// Layer of the layout that is used.
    CurrentLayer(u16),
    /// What a pose says.
    PoseDataFormat(PoseDataFormat),
    /// What reflectors say.
    LandmarkDataFormat(LandmarkDataFormat),
    /// What a scan holds.
    ScanDataFormat(ScanDataFormat),
    /// Number of poses that are averaged.
    SlidingMean(u8),
    /// How mapping is done.
    MapConfiguration(MapConfiguration),
    /// Size of reflectors, 1 to 150 mm.
    ReflectorSize(Size),
    /// Shape of reflectors.
    ReflectorType(ReflectorType),
    /// How far from its expected place a reflector may be seen.
    IdentificationWindow(IdentificationWindow),
    /// How many of the nearest reflectors are used; 0 is all.
    NearestReflectors(u8),
    /// Between which distances reflectors are used. The width of the numbers is not verified.
    ActionRadius(Distance, Distance),
    /// How strong the echo of a reflector must be, percent.
    ReflectorThreshold(u8),
    /// How reflectors are compared with the layout.
    LandmarkMatching(u8),
    /// Directions in which nothing is seen; the layout of the list is not verified.
    MutedSectors(Raw<'a>),
    /// Direction of rotation of the coordinate system.
    CoordinateOrientation(u8),
    /// Synchronisation of the clock by a hardware input: mode and mask. The width of the numbers is not verified.
    HardwareTimeSync(u8, u8),
    /// Dialect of the answers.
    ColaDialect(Dialect),
}

impl<'a> Setting<'a> {
    /// Which variable it is.
    #[must_use]
    pub const fn variable(&self) -> Variable {
        match self {
            Self::CurrentLayer(_) => Variable::CurrentLayer,
            Self::PoseDataFormat(_) => Variable::PoseDataFormat,
            Self::LandmarkDataFormat(_) => Variable::LandmarkDataFormat,
            Self::ScanDataFormat(_) => Variable::ScanDataFormat,
            Self::SlidingMean(_) => Variable::SlidingMean,
            Self::MapConfiguration(_) => Variable::MapConfiguration,
            Self::ReflectorSize(_) => Variable::ReflectorSize,
            Self::ReflectorType(_) => Variable::ReflectorType,
            Self::IdentificationWindow(_) => Variable::IdentificationWindow,
            Self::NearestReflectors(_) => Variable::NearestReflectors,
            Self::ActionRadius(..) => Variable::ActionRadius,
            Self::ReflectorThreshold(_) => Variable::ReflectorThreshold,
            Self::LandmarkMatching(_) => Variable::LandmarkMatching,
            Self::MutedSectors(_) => Variable::MutedSectors,
            Self::CoordinateOrientation(_) => Variable::CoordinateOrientation,
            Self::HardwareTimeSync(..) => Variable::HardwareTimeSync,
            Self::ColaDialect(_) => Variable::ColaDialect,
        }
    }

    /// Reads the value of `variable`; None if it has no value of a known kind.
    ///
    /// # Errors
    /// If the arguments are not such a value.
    pub fn read(variable: Variable, reader: &mut Reader<'a>) -> Result<Option<Self>, ReadError> {
        Ok(Some(match variable {
            Variable::DeviceIdent | Variable::SerialNumber | Variable::DeviceInfo | Variable::FirmwareVersion => {
                return Ok(None);
            }
            Variable::CurrentLayer => Self::CurrentLayer(reader.u16()?),
            Variable::PoseDataFormat => {
                Self::PoseDataFormat(PoseDataFormat { is_extrapolated: choice(reader)?, has_details: choice(reader)? })
            }
            Variable::LandmarkDataFormat => Self::LandmarkDataFormat(LandmarkDataFormat {
                coordinates: if choice(reader)? { CoordinateFormat::Polar } else { CoordinateFormat::Cartesian },
                has_details: choice(reader)?,
                filter: reader.u8()?,
            }),
            Variable::ScanDataFormat => {
                Self::ScanDataFormat(ScanDataFormat { channels: reader.u8()?, has_remission: choice(reader)? })
            }
            Variable::SlidingMean => Self::SlidingMean(reader.u8()?),
            Variable::MapConfiguration => Self::MapConfiguration(MapConfiguration {
                mean: reader.u8()?,
                only_unknown: choice(reader)?,
                x: Coordinate(reader.i32()?),
                y: Coordinate(reader.i32()?),
                heading: Milliangle(reader.i32()?),
            }),
            Variable::ReflectorSize => Self::ReflectorSize(Size(reader.u16()?)),
            Variable::ReflectorType => Self::ReflectorType(match reader.u8()? {
                1 => ReflectorType::Flat,
                2 => ReflectorType::Cylindrical,
                _ => return Err(ReadError::Value),
            }),
            Variable::IdentificationWindow => Self::IdentificationWindow(IdentificationWindow {
                low: Size(reader.u16()?),
                high: Size(reader.u16()?),
                low_distance: Distance(reader.u32()?),
                high_distance: Distance(reader.u32()?),
            }),
            Variable::NearestReflectors => Self::NearestReflectors(reader.u8()?),
            Variable::ActionRadius => Self::ActionRadius(Distance(reader.u32()?), Distance(reader.u32()?)),
            Variable::ReflectorThreshold => Self::ReflectorThreshold(reader.u8()?),
            Variable::LandmarkMatching => Self::LandmarkMatching(reader.u8()?),
            Variable::MutedSectors => Self::MutedSectors(Raw::read(reader)),
            Variable::CoordinateOrientation => Self::CoordinateOrientation(reader.u8()?),
            Variable::HardwareTimeSync => Self::HardwareTimeSync(reader.u8()?, reader.u8()?),
            Variable::ColaDialect => Self::ColaDialect(if choice(reader)? { Dialect::Binary } else { Dialect::Ascii }),
        }))
    }

    /// Writes the value.
    ///
    /// # Errors
    /// If the buffer is full.
    pub fn write(&self, writer: &mut Writer) -> Result<(), WriteError> {
        match self {
            Self::PoseDataFormat(format) => {
                writer.u8(format.is_extrapolated.into())?;
                writer.u8(format.has_details.into())
            }
            Self::LandmarkDataFormat(format) => {
                writer.u8((format.coordinates == CoordinateFormat::Polar).into())?;
                writer.u8(format.has_details.into())?;
                writer.u8(format.filter)
            }
            Self::ScanDataFormat(format) => {
                writer.u8(format.channels)?;
                writer.u8(format.has_remission.into())
            }
            Self::MapConfiguration(configuration) => {
                writer.u8(configuration.mean)?;
                writer.u8(configuration.only_unknown.into())?;
                writer.i32(configuration.x.0)?;
                writer.i32(configuration.y.0)?;
                writer.i32(configuration.heading.0)
            }
            Self::CurrentLayer(number) | Self::ReflectorSize(Size(number)) => writer.u16(*number),
            Self::ReflectorType(ReflectorType::Flat) => writer.u8(1),
            Self::ReflectorType(ReflectorType::Cylindrical) => writer.u8(2),
            Self::IdentificationWindow(window) => {
                writer.u16(window.low.0)?;
                writer.u16(window.high.0)?;
                writer.u32(window.low_distance.0)?;
                writer.u32(window.high_distance.0)
            }
            Self::ActionRadius(nearest, farthest) => {
                writer.u32(nearest.0)?;
                writer.u32(farthest.0)
            }
            Self::SlidingMean(number)
            | Self::NearestReflectors(number)
            | Self::ReflectorThreshold(number)
            | Self::LandmarkMatching(number)
            | Self::CoordinateOrientation(number) => writer.u8(*number),
            Self::MutedSectors(sectors) => sectors.write(writer),
            Self::HardwareTimeSync(mode, mask) => {
                writer.u8(*mode)?;
                writer.u8(*mask)
            }
            Self::ColaDialect(dialect) => writer.u8((*dialect == Dialect::Binary).into()),
        }
    }
}

/// A number that is 0 or 1.
fn choice(reader: &mut Reader) -> Result<bool, ReadError> {
    match reader.u8()? {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(ReadError::Value),
    }
}
