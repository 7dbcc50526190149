//! Methods that the host calls.

use super::{
    Coordinate, IdentifiedLandmark, LANDMARKS_A_TELEGRAM, LayoutLandmark, Milliangle, OperatingMode, SpeedReport,
};
use crate::cola::{Element, Raw, ReadError, Reader, Sequence, WriteError, Writer};

/// Name of a method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MethodName {
    /// Raises the user level.
    SetAccessMode,
    /// Changes the operating mode.
    ChangeState,
    /// Stores all settings for good.
    StoreParameters,
    /// Ends a method that is running.
    Break,
    /// Restarts the sensor.
    Reset,
    /// Tells the time of the sensor's clock.
    GetTimestamp,
    /// Forgets the layout.
    EraseLayout,
    /// Stores the layout for good.
    StoreLayout,
    /// Adds landmarks to the layout.
    AddLandmarks,
    /// Changes landmarks of the layout.
    SetLandmarks,
    /// Takes landmarks out of the layout.
    DeleteLandmarks,
    /// Tells landmarks of the layout.
    GetLandmarks,
    /// Tells the names of a layer's landmarks.
    GetLayer,
    /// Tells the names of all landmarks.
    GetLayout,
    /// Measures the positions of reflectors.
    DoMapping,
    /// Reflectors and scan without a pose.
    GetLandmarkData,
    /// The pose.
    GetPose,
    /// The pose with reflectors and scan.
    GetData,
    /// Tells the sensor how fast it moves.
    SetSpeed,
    /// Tells the sensor where it is.
    SetPose,
    /// Tells the sensor where it is by the names of landmarks.
    SetPoseByLandmarks,
    /// Changes the address.
    ChangeAddress,
    /// Changes the serial port.
    ChangeSerialPort,
    /// Changes the Ethernet port.
    ChangeEthernet,
    /// Lets a server give the address.
    EnableDhcp,
}

impl MethodName {
    /// All methods.
    pub const ALL: [Self; 25] = [
        Self::SetAccessMode,
        Self::ChangeState,
        Self::StoreParameters,
        Self::Break,
        Self::Reset,
        Self::GetTimestamp,
        Self::EraseLayout,
        Self::StoreLayout,
        Self::AddLandmarks,
        Self::SetLandmarks,
        Self::DeleteLandmarks,
        Self::GetLandmarks,
        Self::GetLayer,
        Self::GetLayout,
        Self::DoMapping,
        Self::GetLandmarkData,
        Self::GetPose,
        Self::GetData,
        Self::SetSpeed,
        Self::SetPose,
        Self::SetPoseByLandmarks,
        Self::ChangeAddress,
        Self::ChangeSerialPort,
        Self::ChangeEthernet,
        Self::EnableDhcp,
    ];

    /// The name in a telegram.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::SetAccessMode => "SetAccessMode",
            Self::ChangeState => "mNEVAChangeState",
            Self::StoreParameters => "mEEwriteall",
            Self::Break => "mNAVBreak",
            Self::Reset => "mNAVReset",
            Self::GetTimestamp => "mNAVGetTimestamp",
            Self::EraseLayout => "mNLAYEraseLayout",
            Self::StoreLayout => "mNLAYStoreLayout",
            Self::AddLandmarks => "mNLAYAddLandmark",
            Self::SetLandmarks => "mNLAYSetLandmark",
            Self::DeleteLandmarks => "mNLAYDelLandmark",
            Self::GetLandmarks => "mNLAYGetLandmark",
            Self::GetLayer => "mNLAYGetLayer",
            Self::GetLayout => "mNLAYGetLayout",
            Self::DoMapping => "mNMAPDoMapping",
            Self::GetLandmarkData => "mNLMDGetData",
            Self::GetPose => "mNPOSGetPose",
            Self::GetData => "mNPOSGetData",
            Self::SetSpeed => "mNPOSSetSpeed",
            Self::SetPose => "mNPOSSetPose",
            Self::SetPoseByLandmarks => "mNPOSSetPoseID",
            Self::ChangeAddress => "mChangeIPCfg",
            Self::ChangeSerialPort => "mChangeSerialCfg",
            Self::ChangeEthernet => "mChangeEthrCfg",
            Self::EnableDhcp => "mEnableDHCP",
        }
    }

    /// The method of that name.
    #[must_use]
    pub fn find(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|method| method.name() == name)
    }

    /// Whether the sensor first says that it has accepted the call, and the result later.
    #[must_use]
    pub const fn is_slow(self) -> bool {
        matches!(self, Self::ChangeState | Self::DoMapping | Self::GetPose | Self::GetData | Self::GetLandmarkData)
    }
}

/// What [`Method::GetData`] shall bring.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DataMask {
    /// The pose and the reflectors.
    PoseAndReflectors,
    /// The pose and the scan.
    PoseAndScan,
    /// All three.
    All,
}

/// A call.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method<'a> {
    /// Raises the user level.
    SetAccessMode {
        /// Number of the level.
        level: u8,
        /// Word of access.
        password: u32,
    },
    /// Changes the operating mode.
    ChangeState(OperatingMode),
    /// Stores all settings for good.
    StoreParameters,
    /// Ends a method that is running.
    Break,
    /// Restarts the sensor.
    Reset,
    /// Tells the time of the sensor's clock.
    GetTimestamp,
    /// Forgets the layout. 1 is in use; which memory 0 and 1 stand for is not verified.
    EraseLayout(u8),
    /// Stores the layout for good.
    StoreLayout,
    /// Adds landmarks to the layout, at most [`LANDMARKS_A_TELEGRAM`].
    AddLandmarks(Sequence<'a, LayoutLandmark>),
    /// Changes landmarks of the layout, at most [`LANDMARKS_A_TELEGRAM`].
    SetLandmarks(Sequence<'a, IdentifiedLandmark>),
    /// Takes landmarks out of the layout, at most [`LANDMARKS_A_TELEGRAM`].
    DeleteLandmarks(Sequence<'a, u16>),
    /// Tells landmarks of the layout, at most [`LANDMARKS_A_TELEGRAM`].
    GetLandmarks(Sequence<'a, u16>),
    /// Tells the names of a layer's landmarks.
    GetLayer(u16),
    /// Tells the names of all landmarks.
    GetLayout,
    /// Measures the positions of reflectors.
    DoMapping,
    /// Reflectors and scan without a pose.
    GetLandmarkData {
        /// Whether to wait for the next revolution.
        wait: bool,
        /// 0 reflectors, 1 scan, 2 both; not verified.
        dataset: u8,
    },
    /// The pose.
    GetPose {
        /// Whether to wait for the next revolution.
        wait: bool,
    },
    /// The pose with reflectors and scan.
    GetData {
        /// Whether to wait for the next revolution.
        wait: bool,
        /// What to bring.
        mask: DataMask,
    },
    /// Tells the sensor how fast it moves.
    SetSpeed(SpeedReport),
    /// Tells the sensor where it is in the layout.
    SetPose(Coordinate, Coordinate, Milliangle),
    /// A method whose arguments are not verified.
    Other(MethodName, Raw<'a>),
}

impl<'a> Method<'a> {
    /// Which method it is.
    #[must_use]
    pub const fn name(&self) -> MethodName {
        match self {
            Self::SetAccessMode { .. } => MethodName::SetAccessMode,
            Self::ChangeState(_) => MethodName::ChangeState,
            Self::StoreParameters => MethodName::StoreParameters,
            Self::Break => MethodName::Break,
            Self::Reset => MethodName::Reset,
            Self::GetTimestamp => MethodName::GetTimestamp,
            Self::EraseLayout(_) => MethodName::EraseLayout,
            Self::StoreLayout => MethodName::StoreLayout,
            Self::AddLandmarks(_) => MethodName::AddLandmarks,
            Self::SetLandmarks(_) => MethodName::SetLandmarks,
            Self::DeleteLandmarks(_) => MethodName::DeleteLandmarks,
            Self::GetLandmarks(_) => MethodName::GetLandmarks,
            Self::GetLayer(_) => MethodName::GetLayer,
            Self::GetLayout => MethodName::GetLayout,
            Self::DoMapping => MethodName::DoMapping,
            Self::GetLandmarkData { .. } => MethodName::GetLandmarkData,
            Self::GetPose { .. } => MethodName::GetPose,
            Self::GetData { .. } => MethodName::GetData,
            Self::SetSpeed(_) => MethodName::SetSpeed,
            Self::SetPose(..) => MethodName::SetPose,
            Self::Other(name, _) => *name,
        }
    }

    /// Reads the arguments of the method `name`.
    ///
    /// # Errors
    /// If they are not what the method demands.
    pub fn read(name: MethodName, reader: &mut Reader<'a>) -> Result<Self, ReadError> {
        Ok(match name {
            MethodName::SetAccessMode => Self::SetAccessMode { level: reader.u8()?, password: reader.u32()? },
            MethodName::ChangeState => Self::ChangeState(OperatingMode::read(reader)?),
            MethodName::StoreParameters => Self::StoreParameters,
            MethodName::Break => Self::Break,
            MethodName::Reset => Self::Reset,
            MethodName::GetTimestamp => Self::GetTimestamp,
            MethodName::EraseLayout => Self::EraseLayout(reader.u8()?),
            MethodName::StoreLayout => Self::StoreLayout,
            MethodName::AddLandmarks => Self::AddLandmarks(read_landmarks(reader)?),
            MethodName::SetLandmarks => Self::SetLandmarks(read_landmarks(reader)?),
            MethodName::DeleteLandmarks => Self::DeleteLandmarks(read_landmarks(reader)?),
            MethodName::GetLandmarks => Self::GetLandmarks(read_landmarks(reader)?),
            MethodName::GetLayer => Self::GetLayer(reader.u16()?),
            MethodName::GetLayout => Self::GetLayout,
            MethodName::DoMapping => Self::DoMapping,
            MethodName::GetLandmarkData => Self::GetLandmarkData { wait: read_wait(reader)?, dataset: reader.u8()? },
            MethodName::GetPose => Self::GetPose { wait: read_wait(reader)? },
            MethodName::GetData => Self::GetData {
                wait: read_wait(reader)?,
                mask: match reader.u8()? {
                    0 => DataMask::PoseAndReflectors,
                    1 => DataMask::PoseAndScan,
                    2 => DataMask::All,
                    _ => return Err(ReadError::Value),
                },
            },
            MethodName::SetSpeed => Self::SetSpeed(SpeedReport::read(reader)?),
            MethodName::SetPose => {
                Self::SetPose(Coordinate(reader.i32()?), Coordinate(reader.i32()?), Milliangle(reader.i32()?))
            }
            MethodName::SetPoseByLandmarks
            | MethodName::ChangeAddress
            | MethodName::ChangeSerialPort
            | MethodName::ChangeEthernet
            | MethodName::EnableDhcp => Self::Other(name, Raw::read(reader)),
        })
    }

    /// Writes the arguments.
    ///
    /// # Errors
    /// If they do not fit.
    pub fn write(&self, writer: &mut Writer) -> Result<(), WriteError> {
        match self {
            Self::SetAccessMode { level, password } => {
                writer.u8(*level)?;
                writer.u32(*password)
            }
            Self::ChangeState(mode) => mode.write(writer),
            Self::StoreParameters
            | Self::Break
            | Self::Reset
            | Self::GetTimestamp
            | Self::StoreLayout
            | Self::GetLayout
            | Self::DoMapping => Ok(()),
            Self::EraseLayout(memory) => writer.u8(*memory),
            Self::AddLandmarks(landmarks) => write_landmarks(landmarks, writer),
            Self::SetLandmarks(landmarks) => write_landmarks(landmarks, writer),
            Self::DeleteLandmarks(ids) | Self::GetLandmarks(ids) => write_landmarks(ids, writer),
            Self::GetLayer(layer) => writer.u16(*layer),
            Self::GetLandmarkData { wait, dataset } => {
                writer.u8((*wait).into())?;
                writer.u8(*dataset)
            }
            Self::GetPose { wait } => writer.u8((*wait).into()),
            Self::GetData { wait, mask } => {
                writer.u8((*wait).into())?;
                writer.u8(*mask as u8)
            }
            Self::SetSpeed(speed) => speed.write(writer),
            Self::SetPose(x, y, heading) => {
                writer.i32(x.0)?;
                writer.i32(y.0)?;
                writer.i32(heading.0)
            }
            Self::Other(_, arguments) => arguments.write(writer),
        }
    }
}

fn read_wait(reader: &mut Reader) -> Result<bool, ReadError> {
    match reader.u8()? {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(ReadError::Value),
    }
}

fn read_landmarks<'a, T: Element>(reader: &mut Reader<'a>) -> Result<Sequence<'a, T>, ReadError> {
    let count = usize::from(reader.u16()?);
    if count > LANDMARKS_A_TELEGRAM {
        return Err(ReadError::Capacity);
    }
    Sequence::read(reader, count)
}

fn write_landmarks<T: Element>(landmarks: &Sequence<T>, writer: &mut Writer) -> Result<(), WriteError> {
    if landmarks.len() > LANDMARKS_A_TELEGRAM {
        return Err(WriteError::TooMany);
    }
    writer.count(landmarks.len())?;
    landmarks.write(writer)
}
