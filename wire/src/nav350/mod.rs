//! Telegrams of the SICK NAV350 laser positioning sensor, and the session that a host holds with it.
//!
//! [`Request`] and [`Answer`] are all telegrams in both dialects. Raw numbers keep the sensor's units in types of their
//! own; [`Revolution`] is where they become metres, radians, the frame S and the vehicle's clock.
//!
//! Source: SICK telegram listing NAV350 as far as it is known from SICK's public driver (sick_scan_xd), from other public
//! drivers that ran on sensors, and from recorded telegrams. Facts that rest on less say so.

mod answer;
mod channel;
mod clock;
mod layout;
mod method;
mod mode;
mod orientation;
mod pose;
mod reflector;
mod request;
mod revolution;
mod sensor_frame;
mod session;
mod setting;
mod speed;
mod units;
mod variable;
mod watch;

pub use answer::{Answer, LandmarkData, MethodResult, NavigationData, PoseAnswer, Value};
pub use channel::{Channel, ChannelName};
pub use clock::{ClockError, SensorClock};
pub use layout::{IdentifiedLandmark, LANDMARKS_A_TELEGRAM, LAYERS_A_LANDMARK, LayoutLandmark};
pub use method::{DataMask, Method, MethodName};
pub use mode::{ErrorCode, OperatingMode, UserLevel};
pub use orientation::Orientation;
pub use pose::{PoseDetails, PoseReport, PositionMode};
pub use reflector::{Reflector, ReflectorDetails, ReflectorList};
pub use request::Request;
pub use revolution::{Revolution, RevolutionError, SensorPose};
pub use sensor_frame::SensorFrame;
pub use session::{Configuration, LostReason, Report, Session, State, Step};
pub use setting::{
    CoordinateFormat, IdentificationWindow, LandmarkDataFormat, MapConfiguration, PoseDataFormat, ReflectorType,
    ScanDataFormat, Setting,
};
pub use speed::{SensorSpeed, SpeedReport};
pub use units::{Angle, Coordinate, DeviceTime, Distance, Milliangle, RotationSpeed, Size, Velocity};
pub use variable::Variable;
pub use watch::SensorWatch;
