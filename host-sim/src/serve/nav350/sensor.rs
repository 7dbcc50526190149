//! What the sensor is: its settings, layout, modes and clock.

use agv_wire::cola::Dialect;
use agv_wire::nav350::{DeviceTime, IdentifiedLandmark, OperatingMode, Orientation, SensorFrame, Setting, SpeedReport};

use super::drive::{Drive, Turn};
use super::factory;

/// A sensor. Times are seconds since it was started, by a right clock.
pub struct Sensor {
    pub(super) drive: Drive,
    clock: SensorClockOptions,
    pub(super) stands: bool,
    pub(super) dialect: Option<Dialect>,
    pub(super) mode: OperatingMode,
    pub(super) level: u8,
    pub(super) layout: Vec<IdentifiedLandmark>,
    pub(super) settings: Vec<Setting<'static>>,
    pub(super) speed: Option<SpeedReport>,
    /// When the drive began.
    pub(super) drive_start: Option<f64>,
    /// Time from an acknowledgement to the result, s.
    pub(super) gap: f64,
    /// Directions in which nothing is to be seen, as they were written, and how.
    pub(super) muted: (Dialect, Vec<u8>),
}

/// What the sensor's own clock shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SensorClockOptions {
    /// What it shows at the start, ms.
    pub start: u32,
    /// By which share it is too fast.
    pub drift: f64,
    /// When it jumps, s since the start, and by how much, ms.
    pub jumps: Vec<(f64, i64)>,
}

impl SensorClockOptions {
    fn shows(&self, seconds: f64) -> DeviceTime {
        let jumped: i64 = self.jumps.iter().filter(|(time, _)| *time <= seconds).map(|(_, jump)| jump).sum();
        let milliseconds = (seconds * (1.0 + self.drift) * 1e3).floor() as i64 + jumped;
        DeviceTime(self.start.wrapping_add(milliseconds as u32))
    }
}

impl Sensor {
    /// A sensor that was just started.
    #[must_use]
    pub fn new(drive: Drive, clock: SensorClockOptions, dialect: Option<Dialect>, stands: bool) -> Self {
        let layout = drive.layout().to_vec();
        Self {
            drive,
            clock,
            stands,
            dialect,
            mode: OperatingMode::PowerDown,
            level: 0,
            layout,
            settings: factory::settings(),
            speed: None,
            drive_start: None,
            gap: 0.0,
            muted: (Dialect::Ascii, b"0".to_vec()),
        }
    }

    /// The same sensor, whose results follow their acknowledgements by so many seconds.
    #[must_use]
    pub fn with_gap(self, gap: f64) -> Self {
        Self { gap, ..self }
    }

    /// The speed that the sensor was told last.
    #[must_use]
    pub fn speed(&self) -> Option<SpeedReport> {
        self.speed
    }

    /// What the sensor sees.
    #[must_use]
    pub fn drive(&self) -> &Drive {
        &self.drive
    }

    /// Takes a turn that a sensor whose drive goes on has just ended.
    pub fn see(&mut self, turn: Turn) {
        self.drive.push(turn);
    }

    /// The layout as it is now.
    #[must_use]
    pub fn layout(&self) -> &[IdentifiedLandmark] {
        &self.layout
    }

    /// Lets the vehicle of a sensor that stands drive off at `time`.
    pub fn begin(&mut self, time: f64) {
        self.drive_start = Some(time);
    }

    /// Whether its angles grow the other way than those of the drive.
    pub(super) fn is_turned(&self) -> bool {
        self.settings.contains(&Setting::CoordinateOrientation(Orientation::Clockwise as u8))
    }

    /// Its axes, with the orientation that it was told.
    pub(super) fn frame(&self) -> SensorFrame {
        let frame = self.drive.frame;
        SensorFrame { is_clockwise: frame.is_clockwise != self.is_turned(), ..frame }
    }

    pub(super) fn device_time(&self, seconds: f64) -> DeviceTime {
        self.clock.shows(seconds)
    }
}
