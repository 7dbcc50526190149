//! What the host wants of the sensor.

use crate::cola::Dialect;
use crate::nav350::{
    CoordinateFormat, DataMask, LandmarkDataFormat, OperatingMode, Orientation, PoseDataFormat, ScanDataFormat,
    SensorFrame, Setting, UserLevel, Variable,
};

/// What the host wants of the sensor, and how patient it is. All times are in seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Configuration {
    /// Dialect of the first question; the first answer decides.
    pub first_dialect: Dialect,
    /// User level that is asked for.
    pub user_level: UserLevel,
    /// Word of access of that level.
    pub password: u32,
    /// Layer of the layout; None leaves it as it is.
    pub layer: Option<u16>,
    /// What a pose says.
    pub pose_format: PoseDataFormat,
    /// What reflectors say.
    pub landmark_format: LandmarkDataFormat,
    /// What a scan holds.
    pub scan_format: ScanDataFormat,
    /// Which way its angles grow; None leaves it as it is, and [`Self::frame`] follows what it says.
    pub orientation: Option<Orientation>,
    /// Navigation, or landmark detection for a sensor without a layout.
    pub mode: OperatingMode,
    /// What is asked for in navigation.
    pub mask: DataMask,
    /// How the sensor's head lies and turns.
    pub frame: SensorFrame,
    /// Least time between two questions for data. The sensor answers with its next revolution, so a little less than
    /// a revolution lets it set the pace and misses none.
    pub poll_spacing: f64,
    /// Least time between two speeds.
    pub speed_spacing: f64,
    /// Time between two questions for the sensor's clock.
    pub clock_interval: f64,
    /// How many such questions come before the first revolution.
    pub clock_exchanges: u8,
    /// How long a connection may take.
    pub connect_timeout: f64,
    /// How long an answer may take.
    pub answer_timeout: f64,
    /// How long a change of the operating mode may take; the head may have to start.
    pub mode_timeout: f64,
    /// Pause before the first new attempt.
    pub first_pause: f64,
    /// Longest pause; pauses double up to it.
    pub longest_pause: f64,
}

impl Default for Configuration {
    fn default() -> Self {
        let user_level = UserLevel::AuthorisedClient;
        Self {
            first_dialect: Dialect::Binary,
            user_level,
            password: user_level.default_password(),
            layer: None,
            pose_format: PoseDataFormat { is_extrapolated: true, has_details: true },
            landmark_format: LandmarkDataFormat {
                coordinates: CoordinateFormat::Cartesian,
                has_details: true,
                filter: 1,
            },
            scan_format: ScanDataFormat { channels: 1, has_remission: true },
            orientation: Some(Orientation::CounterClockwise),
            mode: OperatingMode::Navigation,
            mask: DataMask::All,
            frame: SensorFrame::default(),
            poll_spacing: 0.1,
            speed_spacing: 0.025,
            clock_interval: 1.0,
            clock_exchanges: 8,
            connect_timeout: 5.0,
            answer_timeout: 1.0,
            mode_timeout: 20.0,
            first_pause: 0.25,
            longest_pause: 8.0,
        }
    }
}

impl Configuration {
    /// What a variable is to be; None if it may be as it is.
    pub(super) fn wanted(&self, variable: Variable) -> Option<Setting<'static>> {
        match variable {
            Variable::CurrentLayer => self.layer.map(Setting::CurrentLayer),
            Variable::LandmarkDataFormat => Some(Setting::LandmarkDataFormat(self.landmark_format)),
            Variable::ScanDataFormat => Some(Setting::ScanDataFormat(self.scan_format)),
            Variable::PoseDataFormat => Some(Setting::PoseDataFormat(self.pose_format)),
            Variable::CoordinateOrientation => {
                self.orientation.map(|orientation| Setting::CoordinateOrientation(orientation as u8))
            }
            _ => None,
        }
    }
}
