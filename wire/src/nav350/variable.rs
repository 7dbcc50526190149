//! Names of what can be read or written.

/// A variable of the sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variable {
    /// Name and version of the sensor.
    DeviceIdent,
    /// Serial number.
    SerialNumber,
    /// Device information.
    DeviceInfo,
    /// Version of the firmware.
    FirmwareVersion,
    /// Layer of the layout that is used.
    CurrentLayer,
    /// What a pose says.
    PoseDataFormat,
    /// What reflectors say.
    LandmarkDataFormat,
    /// What a scan holds.
    ScanDataFormat,
    /// Number of poses that are averaged.
    SlidingMean,
    /// How mapping is done.
    MapConfiguration,
    /// Size of reflectors.
    ReflectorSize,
    /// Shape of reflectors.
    ReflectorType,
    /// How far from its expected place a reflector may be seen.
    IdentificationWindow,
    /// How many of the nearest reflectors are used.
    NearestReflectors,
    /// Between which distances reflectors are used.
    ActionRadius,
    /// How strong the echo of a reflector must be.
    ReflectorThreshold,
    /// How reflectors are compared with the layout.
    LandmarkMatching,
    /// Directions in which nothing is seen.
    MutedSectors,
    /// Direction of rotation of the coordinate system.
    CoordinateOrientation,
    /// Synchronisation of the clock by a hardware input.
    HardwareTimeSync,
    /// Dialect of the answers.
    ColaDialect,
}

impl Variable {
    /// All variables.
    pub const ALL: [Self; 21] = [
        Self::DeviceIdent,
        Self::SerialNumber,
        Self::DeviceInfo,
        Self::FirmwareVersion,
        Self::CurrentLayer,
        Self::PoseDataFormat,
        Self::LandmarkDataFormat,
        Self::ScanDataFormat,
        Self::SlidingMean,
        Self::MapConfiguration,
        Self::ReflectorSize,
        Self::ReflectorType,
        Self::IdentificationWindow,
        Self::NearestReflectors,
        Self::ActionRadius,
        Self::ReflectorThreshold,
        Self::LandmarkMatching,
        Self::MutedSectors,
        Self::CoordinateOrientation,
        Self::HardwareTimeSync,
        Self::ColaDialect,
    ];

    /// The name in a telegram.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::DeviceIdent => "DeviceIdent",
            Self::SerialNumber => "SerialNumber",
            Self::DeviceInfo => "MMDeviceInfo",
            Self::FirmwareVersion => "FirmwareVersion",
            Self::CurrentLayer => "NEVACurrLayer",
            Self::PoseDataFormat => "NPOSPoseDataFormat",
            Self::LandmarkDataFormat => "NLMDLandmarkDataFormat",
            Self::ScanDataFormat => "NAVScanDataFormat",
            Self::SlidingMean => "NPOSSlidingMean",
            Self::MapConfiguration => "NMAPMapCfg",
            Self::ReflectorSize => "NLMDReflSize",
            Self::ReflectorType => "NLMDReflType",
            Self::IdentificationWindow => "NCORIdentWindow",
            Self::NearestReflectors => "NLMDnClosest",
            Self::ActionRadius => "NLMDActionRadius",
            Self::ReflectorThreshold => "NLMDReflThreshold",
            Self::LandmarkMatching => "NLMDLandmarkMatching",
            Self::MutedSectors => "NLMDMutedSectors",
            Self::CoordinateOrientation => "NEVACoordOrientation",
            Self::HardwareTimeSync => "NAVHardwareTimeSync",
            Self::ColaDialect => "EIHstCola",
        }
    }

    /// The variable of that name.
    #[must_use]
    pub fn find(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|variable| variable.name() == name)
    }
}
