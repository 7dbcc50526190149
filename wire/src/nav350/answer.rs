//! What the sensor sends.

use heapless::Vec;

use super::{
    Channel, DeviceTime, ErrorCode, IdentifiedLandmark, MethodName, OperatingMode, PoseReport, ReflectorList, Setting,
    Variable,
};
use crate::cola::{CommandWord, Dialect, Fault, Raw, ReadError, Reader, Sequence, Telegram, Text, WriteError, Writer};

/// Channels of 32 bits that are kept of an answer.
const CHANNELS: usize = 2;
/// Channels of 32 bits that an answer can have.
const MOST_CHANNELS: usize = 4;

/// The pose with reflectors and scan.
#[derive(Clone, Debug, PartialEq)]
pub struct NavigationData<'a> {
    /// Version of the layout of this answer.
    pub version: u16,
    /// How the method ended. Without a position, reflectors and scan are valid all the same.
    pub error: ErrorCode,
    /// As it was asked for.
    pub wait: u8,
    /// As it was asked for.
    pub mask: u8,
    /// The pose.
    pub pose: Option<PoseReport>,
    /// The reflectors.
    pub reflectors: Option<ReflectorList<'a>>,
    /// Distances and directions: the first two channels, if there are more.
    pub channels: Vec<Channel<'a, u32>, CHANNELS>,
    /// Strength of echoes.
    pub remission: Option<Channel<'a, u16>>,
}

/// Reflectors and scan without a pose.
#[derive(Clone, Debug, PartialEq)]
pub struct LandmarkData<'a> {
    /// Version of the layout of this answer.
    pub version: u16,
    /// How the method ended.
    pub error: ErrorCode,
    /// As it was asked for.
    pub wait: u8,
    /// As it was asked for.
    pub dataset: u8,
    /// The reflectors.
    pub reflectors: Option<ReflectorList<'a>>,
    /// Distances and directions: the first two channels, if there are more.
    pub channels: Vec<Channel<'a, u32>, CHANNELS>,
    /// Strength of echoes.
    pub remission: Option<Channel<'a, u16>>,
}

/// The pose alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PoseAnswer {
    /// Version of the layout of this answer.
    pub version: u16,
    /// How the method ended.
    pub error: ErrorCode,
    /// As it was asked for.
    pub wait: u8,
    /// The pose.
    pub pose: Option<PoseReport>,
}

/// The value of a variable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value<'a> {
    /// A setting.
    Setting(Setting<'a>),
    /// Name and version.
    DeviceIdent(Text<'a>, Text<'a>),
    /// Serial number.
    SerialNumber(Text<'a>),
    /// Version of the firmware.
    FirmwareVersion(Text<'a>),
    /// A variable whose value is of no known kind.
    Other(&'a str, Raw<'a>),
}

/// The result of a method.
#[derive(Clone, Debug, PartialEq)]
pub enum MethodResult<'a> {
    /// Whether the user level was granted.
    AccessMode(bool),
    /// The operating mode after the change; sensors may leave it out if the change failed.
    State(ErrorCode, Option<OperatingMode>),
    /// The sensor's clock.
    Timestamp(ErrorCode, DeviceTime),
    /// Names of landmarks: those that were added, those of a layer, or all. That the last two look like the first is not
    /// verified.
    LandmarkIds(MethodName, ErrorCode, Sequence<'a, u16>),
    /// Landmarks of the layout. The layout of this answer is not verified.
    Landmarks(ErrorCode, Sequence<'a, IdentifiedLandmark>),
    /// The reflectors that mapping has found.
    Mapping(ErrorCode, Option<ReflectorList<'a>>),
    /// Reflectors and scan without a pose.
    LandmarkData(LandmarkData<'a>),
    /// The pose.
    Pose(PoseAnswer),
    /// The pose with reflectors and scan.
    Data(NavigationData<'a>),
    /// How another method ended. Some sensors say nothing.
    Plain(MethodName, Option<ErrorCode>),
}

impl MethodResult<'_> {
    /// Of which method.
    #[must_use]
    pub const fn method(&self) -> MethodName {
        match self {
            Self::AccessMode(_) => MethodName::SetAccessMode,
            Self::State(..) => MethodName::ChangeState,
            Self::Timestamp(..) => MethodName::GetTimestamp,
            Self::LandmarkIds(method, ..) | Self::Plain(method, _) => *method,
            Self::Landmarks(..) => MethodName::GetLandmarks,
            Self::Mapping(..) => MethodName::DoMapping,
            Self::LandmarkData(_) => MethodName::GetLandmarkData,
            Self::Pose(_) => MethodName::GetPose,
            Self::Data(_) => MethodName::GetData,
        }
    }
}

/// A telegram of the sensor.
#[derive(Clone, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "the large variant is the one that comes eight times a second")]
pub enum Answer<'a> {
    /// The value of a variable.
    Value(Value<'a>),
    /// A variable was written.
    Written(Variable),
    /// A method was accepted; its result follows.
    Accepted(MethodName),
    /// The result of a method.
    Result(MethodResult<'a>),
    /// A refusal.
    Fault(Fault),
}

impl<'a> Answer<'a> {
    /// Writes the telegram with its frame to the beginning of `buffer`; returns its length, bytes.
    ///
    /// # Errors
    /// If it does not fit into the buffer or a telegram.
    pub fn encode(&self, dialect: Dialect, buffer: &mut [u8]) -> Result<usize, WriteError> {
        match self {
            Self::Value(value) => value.encode(dialect, buffer),
            Self::Written(variable) => {
                Writer::new(dialect, CommandWord::WriteAnswer, variable.name(), buffer)?.finish()
            }
            Self::Accepted(method) => {
                Writer::new(dialect, CommandWord::MethodAccepted, method.name(), buffer)?.finish()
            }
            Self::Result(result) => {
                let mut writer = Writer::new(dialect, CommandWord::MethodAnswer, result.method().name(), buffer)?;
                result.write(&mut writer)?;
                writer.finish()
            }
            Self::Fault(fault) => Writer::fault(dialect, *fault, buffer),
        }
    }

    /// Reads a payload. Arguments behind the known ones are ignored, because a newer sensor may have more to say.
    ///
    /// # Errors
    /// If it is no answer of a known name with at least the arguments that this name demands.
    pub fn decode(dialect: Dialect, payload: &'a [u8]) -> Result<Self, ReadError> {
        let Telegram { command, name, arguments: mut reader } = Telegram::parse(dialect, payload)?;
        let method = || MethodName::find(name).ok_or(ReadError::Value);
        Ok(match command {
            CommandWord::ReadAnswer => Self::Value(Value::read(name, reader)?),
            CommandWord::WriteAnswer => Self::Written(Variable::find(name).ok_or(ReadError::Value)?),
            CommandWord::MethodAccepted => Self::Accepted(method()?),
            CommandWord::MethodAnswer => Self::Result(MethodResult::read(method()?, &mut reader)?),
            CommandWord::Fault => Self::Fault(Fault(reader.u16()?)),
            _ => return Err(ReadError::Value),
        })
    }
}

impl<'a> Value<'a> {
    fn name(&self) -> &'a str {
        match self {
            Self::Setting(setting) => setting.variable().name(),
            Self::DeviceIdent(..) => Variable::DeviceIdent.name(),
            Self::SerialNumber(_) => Variable::SerialNumber.name(),
            Self::FirmwareVersion(_) => Variable::FirmwareVersion.name(),
            Self::Other(name, _) => name,
        }
    }

    fn encode(&self, dialect: Dialect, buffer: &mut [u8]) -> Result<usize, WriteError> {
        let mut writer = Writer::new(dialect, CommandWord::ReadAnswer, self.name(), buffer)?;
        match self {
            Self::Setting(setting) => setting.write(&mut writer)?,
            Self::DeviceIdent(name, version) => {
                writer.text(name.0)?;
                writer.text(version.0)?;
            }
            Self::SerialNumber(text) | Self::FirmwareVersion(text) => writer.text(text.0)?,
            Self::Other(_, arguments) => arguments.write(&mut writer)?,
        }
        writer.finish()
    }

    fn read(name: &'a str, mut reader: Reader<'a>) -> Result<Self, ReadError> {
        let unparsed = reader;
        // How a NAV350 tells its identity is not verified, so what is not two texts or one is kept as it came.
        let identity = match Variable::find(name) {
            Some(Variable::DeviceIdent) => {
                Text::read(&mut reader).and_then(|ident| Ok(Self::DeviceIdent(ident, Text::read(&mut reader)?)))
            }
            Some(Variable::SerialNumber) => Text::read(&mut reader).map(Self::SerialNumber),
            Some(Variable::FirmwareVersion) => Text::read(&mut reader).map(Self::FirmwareVersion),
            Some(variable) => match Setting::read(variable, &mut reader)? {
                Some(setting) => return Ok(Self::Setting(setting)),
                None => Err(ReadError::Value),
            },
            None => Err(ReadError::Value),
        };
        match identity {
            Ok(identity) if reader.is_empty() => Ok(identity),
            _ => Ok(Self::Other(name, Raw { dialect: unparsed.dialect(), bytes: unparsed.rest() })),
        }
    }
}

impl<'a> MethodResult<'a> {
    fn read(method: MethodName, reader: &mut Reader<'a>) -> Result<Self, ReadError> {
        Ok(match method {
            MethodName::SetAccessMode => Self::AccessMode(reader.u8()? != 0),
            MethodName::ChangeState => {
                let error = ErrorCode::read(reader)?;
                let is_left_out = error != ErrorCode::OK && reader.is_empty();
                Self::State(error, if is_left_out { None } else { Some(OperatingMode::read(reader)?) })
            }
            MethodName::GetTimestamp => Self::Timestamp(ErrorCode::read(reader)?, DeviceTime(reader.u32()?)),
            MethodName::AddLandmarks | MethodName::GetLayer | MethodName::GetLayout => {
                let (error, count) = read_count(reader)?;
                Self::LandmarkIds(method, error, Sequence::read(reader, count)?)
            }
            MethodName::GetLandmarks => {
                let (error, count) = read_count(reader)?;
                Self::Landmarks(error, Sequence::read(reader, count)?)
            }
            MethodName::DoMapping => {
                let error = ErrorCode::read(reader)?;
                let is_left_out = error != ErrorCode::OK && reader.is_empty();
                Self::Mapping(error, if is_left_out { None } else { ReflectorList::read(reader)? })
            }
            MethodName::GetLandmarkData => Self::LandmarkData(LandmarkData {
                version: reader.u16()?,
                error: ErrorCode::read(reader)?,
                wait: reader.u8()?,
                dataset: reader.u8()?,
                reflectors: ReflectorList::read(reader)?,
                channels: read_channels(reader)?,
                remission: read_remission(reader)?,
            }),
            MethodName::GetPose => Self::Pose(PoseAnswer {
                version: reader.u16()?,
                error: ErrorCode::read(reader)?,
                wait: reader.u8()?,
                pose: read_pose(reader)?,
            }),
            MethodName::GetData => Self::Data(NavigationData {
                version: reader.u16()?,
                error: ErrorCode::read(reader)?,
                wait: reader.u8()?,
                mask: reader.u8()?,
                pose: read_pose(reader)?,
                reflectors: ReflectorList::read(reader)?,
                channels: read_channels(reader)?,
                remission: read_remission(reader)?,
            }),
            _ => Self::Plain(method, if reader.is_empty() { None } else { Some(ErrorCode::read(reader)?) }),
        })
    }

    fn write(&self, writer: &mut Writer) -> Result<(), WriteError> {
        match self {
            Self::AccessMode(granted) => writer.u8((*granted).into()),
            Self::State(error, mode) => {
                error.write(writer)?;
                mode.map_or(Ok(()), |mode| mode.write(writer))
            }
            Self::Timestamp(error, time) => {
                error.write(writer)?;
                writer.u32(time.0)
            }
            Self::LandmarkIds(_, error, ids) => {
                error.write(writer)?;
                writer.count(ids.len())?;
                ids.write(writer)
            }
            Self::Landmarks(error, landmarks) => {
                error.write(writer)?;
                writer.count(landmarks.len())?;
                landmarks.write(writer)
            }
            Self::Mapping(error, reflectors) => {
                error.write(writer)?;
                ReflectorList::write(reflectors.as_ref(), writer)
            }
            Self::LandmarkData(data) => {
                writer.u16(data.version)?;
                data.error.write(writer)?;
                writer.u8(data.wait)?;
                writer.u8(data.dataset)?;
                ReflectorList::write(data.reflectors.as_ref(), writer)?;
                write_scan(&data.channels, data.remission.as_ref(), writer)
            }
            Self::Pose(answer) => {
                writer.u16(answer.version)?;
                answer.error.write(writer)?;
                writer.u8(answer.wait)?;
                write_pose(answer.pose.as_ref(), writer)
            }
            Self::Data(data) => {
                writer.u16(data.version)?;
                data.error.write(writer)?;
                writer.u8(data.wait)?;
                writer.u8(data.mask)?;
                write_pose(data.pose.as_ref(), writer)?;
                ReflectorList::write(data.reflectors.as_ref(), writer)?;
                write_scan(&data.channels, data.remission.as_ref(), writer)
            }
            Self::Plain(_, error) => error.map_or(Ok(()), |error| error.write(writer)),
        }
    }
}

/// The number of elements may be left out if the method failed.
fn read_count(reader: &mut Reader) -> Result<(ErrorCode, usize), ReadError> {
    let error = ErrorCode::read(reader)?;
    let is_left_out = error != ErrorCode::OK && reader.is_empty();
    Ok((error, if is_left_out { 0 } else { usize::from(reader.u16()?) }))
}

fn read_pose(reader: &mut Reader) -> Result<Option<PoseReport>, ReadError> {
    Ok(if reader.u16()? == 0 { None } else { Some(PoseReport::read(reader)?) })
}

fn write_pose(pose: Option<&PoseReport>, writer: &mut Writer) -> Result<(), WriteError> {
    writer.u16(pose.is_some().into())?;
    pose.map_or(Ok(()), |pose| pose.write(writer))
}

fn read_channels<'a>(reader: &mut Reader<'a>) -> Result<Vec<Channel<'a, u32>, CHANNELS>, ReadError> {
    let count = usize::from(reader.u16()?);
    if count > MOST_CHANNELS {
        return Err(ReadError::Capacity);
    }
    let mut channels = Vec::new();
    for _ in 0..count {
        // The maker's own client goes on with the first two, too.
        let _ = channels.push(Channel::read(reader)?);
    }
    Ok(channels)
}

fn read_remission<'a>(reader: &mut Reader<'a>) -> Result<Option<Channel<'a, u16>>, ReadError> {
    Ok(if reader.u16()? == 0 { None } else { Some(Channel::read(reader)?) })
}

fn write_scan(
    channels: &[Channel<u32>],
    remission: Option<&Channel<u16>>,
    writer: &mut Writer,
) -> Result<(), WriteError> {
    writer.count(channels.len())?;
    channels.iter().try_for_each(|channel| channel.write(writer))?;
    writer.u16(remission.is_some().into())?;
    remission.map_or(Ok(()), |remission| remission.write(writer))
}
