//! What the sensor is: its settings, layout, modes and clock, and what it answers, without sockets and without a clock
//! of its own.

use agv_wire::cola::{CommandWord, Deframed, Deframer, Dialect, Fault, Raw, Sequence, Telegram, Text};
use agv_wire::nav350::{
    Answer, DeviceTime, ErrorCode, IdentifiedLandmark, Method, MethodName, MethodResult, OperatingMode, Request,
    Setting, Size, SpeedReport, UserLevel, Value, Variable,
};

use super::drive::Drive;
use super::factory;
use super::pending::Pending;
use super::promise::PromisedMethod;

/// A sensor. Times are seconds since it was started, by a right clock.
pub struct Sensor {
    pub(super) drive: Drive,
    clock: SensorClockOptions,
    pub(super) stands: bool,
    dialect: Option<Dialect>,
    pub(super) mode: OperatingMode,
    level: u8,
    layout: Vec<IdentifiedLandmark>,
    pub(super) settings: Vec<Setting<'static>>,
    speed: Option<SpeedReport>,
    /// When the drive began.
    pub(super) drive_start: Option<f64>,
    /// Time from an acknowledgement to the result, s.
    pub(super) gap: f64,
    /// Directions in which nothing is to be seen, as they were written, and how.
    muted: (Dialect, Vec<u8>),
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

/// One connection to a sensor.
#[derive(Default)]
pub struct Connection {
    deframer: Box<Deframer<65_536>>,
    pending: Pending,
}

impl Connection {
    /// What the sensor answers to bytes at once.
    pub fn receive(&mut self, sensor: &mut Sensor, bytes: &[u8], now: f64) -> Vec<u8> {
        let mut answers = Vec::new();
        let mut rest = bytes;
        while !rest.is_empty() {
            let taken = self.deframer.extend(rest);
            rest = &rest[taken..];
            while let Some(found) = self.deframer.next() {
                let Deframed::Telegram { dialect, payload, .. } = found else { continue };
                if sensor.dialect.is_none_or(|only| only == dialect) {
                    answers.extend(sensor.answer(dialect, payload, now, &mut self.pending));
                }
            }
        }
        answers
    }

    /// When the sensor will have something to say by itself.
    #[must_use]
    pub fn due(&self) -> Option<f64> {
        self.pending.due()
    }

    /// What the sensor says by itself.
    pub fn poll(&mut self, sensor: &Sensor, now: f64) -> Option<Vec<u8>> {
        self.pending.poll(sensor, now)
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

    /// The layout as it is now.
    #[must_use]
    pub fn layout(&self) -> &[IdentifiedLandmark] {
        &self.layout
    }

    /// Lets the vehicle of a sensor that stands drive off at `time`.
    pub fn begin(&mut self, time: f64) {
        self.drive_start = Some(time);
    }

    pub(super) fn device_time(&self, seconds: f64) -> DeviceTime {
        self.clock.shows(seconds)
    }

    /// The bytes that answer a payload at once.
    fn answer(&mut self, dialect: Dialect, payload: &[u8], now: f64, pending: &mut Pending) -> Vec<u8> {
        match Request::decode(dialect, payload) {
            Ok(Request::Read(variable)) => self.read(dialect, variable),
            Ok(Request::ReadOther(name)) if MethodName::find(name).is_some() => {
                refuse(dialect, Fault::UNKNOWN_VARIABLE)
            }
            Ok(Request::ReadOther(name)) => zero(dialect, name),
            Ok(Request::Write(setting)) => self.write(dialect, &setting),
            Ok(Request::Call(method)) => self.call(dialect, &method, now, pending),
            Err(_) => refuse(dialect, why(dialect, payload)),
        }
    }

    fn read(&self, dialect: Dialect, variable: Variable) -> Vec<u8> {
        let text = |text: &'static str| Text(text.as_bytes());
        let value = match variable {
            Variable::DeviceIdent => Value::DeviceIdent(text("NAV350"), text("emulated")),
            Variable::SerialNumber => Value::SerialNumber(text("00000000")),
            Variable::FirmwareVersion => Value::FirmwareVersion(text("emulated")),
            Variable::DeviceInfo => return zero(dialect, variable.name()),
            Variable::MutedSectors if self.muted.1 == b"0" => return zero(dialect, variable.name()),
            // What the list means is not known, so it cannot be said in the other dialect.
            Variable::MutedSectors if self.muted.0 != dialect => return refuse(dialect, Fault::LOCAL_CONDITION),
            Variable::MutedSectors => Value::Setting(Setting::MutedSectors(Raw { dialect, bytes: &self.muted.1 })),
            _ => match self.settings.iter().find(|setting| setting.variable() == variable) {
                Some(setting) => Value::Setting(*setting),
                None => return refuse(dialect, Fault::UNKNOWN_VARIABLE),
            },
        };
        encode(dialect, &Answer::Value(value))
    }

    fn write(&mut self, dialect: Dialect, setting: &Setting) -> Vec<u8> {
        let variable = setting.variable();
        if let Setting::ColaDialect(_) = setting {
            return encode(dialect, &Answer::Written(variable));
        }
        if self.level < UserLevel::AuthorisedClient.number() {
            return refuse(dialect, Fault::ACCESS_DENIED);
        }
        if let Setting::MutedSectors(sectors) = setting {
            self.muted = (sectors.dialect, sectors.bytes.to_vec());
            return encode(dialect, &Answer::Written(variable));
        }
        let Some(owned) = owned(setting) else { return refuse(dialect, Fault::INVALID_DATA) };
        match owned {
            Setting::ReflectorSize(Size(size)) if !(1..=150).contains(&size) => {
                return refuse(dialect, Fault::LOCAL_CONDITION);
            }
            Setting::MapConfiguration(configuration) if !(1..=127).contains(&configuration.mean) => {
                return refuse(dialect, Fault::LOCAL_CONDITION);
            }
            _ => {}
        }
        self.settings.retain(|known| known.variable() != variable);
        self.settings.push(owned);
        encode(dialect, &Answer::Written(variable))
    }

    fn call(&mut self, dialect: Dialect, method: &Method, now: f64, pending: &mut Pending) -> Vec<u8> {
        let name = method.name();
        let needs_level = !matches!(
            name,
            MethodName::SetAccessMode
                | MethodName::ChangeState
                | MethodName::DoMapping
                | MethodName::GetTimestamp
                | MethodName::GetData
                | MethodName::GetPose
                | MethodName::GetLandmarkData
                | MethodName::GetLandmarks
                | MethodName::GetLayer
                | MethodName::GetLayout
                | MethodName::SetSpeed
        );
        if needs_level && self.level < UserLevel::AuthorisedClient.number() {
            return refuse(dialect, Fault::ACCESS_DENIED);
        }
        let is_editable = matches!(self.mode, OperatingMode::Standby | OperatingMode::Mapping);
        let edit_error = if is_editable { ErrorCode::OK } else { ErrorCode::WRONG_MODE };
        let result = match method {
            Method::SetAccessMode { level, password } => {
                let levels = [UserLevel::Maintenance, UserLevel::AuthorisedClient, UserLevel::Service];
                let is_granted =
                    levels.iter().any(|known| (known.number(), known.default_password()) == (*level, *password));
                if is_granted {
                    self.level = *level;
                }
                MethodResult::AccessMode(is_granted)
            }
            Method::ChangeState(mode) => {
                self.mode = *mode;
                MethodResult::State(ErrorCode::OK, Some(*mode))
            }
            Method::GetTimestamp => MethodResult::Timestamp(ErrorCode::OK, self.device_time(now)),
            Method::SetSpeed(speed) => {
                let is_right = self.mode == OperatingMode::Navigation;
                self.speed = is_right.then_some(*speed).or(self.speed);
                let error = if is_right { ErrorCode::OK } else { ErrorCode::WRONG_MODE };
                MethodResult::Plain(name, Some(error))
            }
            Method::EraseLayout(_) => {
                if is_editable {
                    self.layout.clear();
                }
                MethodResult::Plain(name, Some(edit_error))
            }
            Method::AddLandmarks(landmarks) => {
                let mut ids = Vec::new();
                if is_editable {
                    for landmark in landmarks.iter() {
                        let id = self.layout.iter().map(|known| known.id + 1).max().unwrap_or(0);
                        self.layout.push(IdentifiedLandmark { id, landmark });
                        ids.push(id);
                    }
                }
                return encode(
                    dialect,
                    &Answer::Result(MethodResult::LandmarkIds(name, edit_error, Sequence::Values(&ids))),
                );
            }
            Method::SetLandmarks(landmarks) => {
                if is_editable {
                    for landmark in landmarks.iter() {
                        match self.layout.iter_mut().find(|known| known.id == landmark.id) {
                            Some(known) => *known = landmark,
                            None => self.layout.push(landmark),
                        }
                    }
                }
                MethodResult::Plain(name, Some(edit_error))
            }
            Method::DeleteLandmarks(ids) => {
                if is_editable {
                    self.layout.retain(|known| !ids.iter().any(|id| id == known.id));
                }
                MethodResult::Plain(name, Some(edit_error))
            }
            Method::GetLandmarks(ids) => {
                let wanted: Vec<_> =
                    ids.iter().filter_map(|id| self.layout.iter().find(|known| known.id == id).cloned()).collect();
                let error = if wanted.len() == ids.len() { ErrorCode::OK } else { ErrorCode::INVALID_DATA };
                return encode(dialect, &Answer::Result(MethodResult::Landmarks(error, Sequence::Values(&wanted))));
            }
            Method::GetLayer(_) | Method::GetLayout => {
                let ids: Vec<u16> = self
                    .layout
                    .iter()
                    .filter(|known| match method {
                        Method::GetLayer(layer) => known.landmark.layers.contains(layer),
                        _ => true,
                    })
                    .map(|known| known.id)
                    .collect();
                return encode(
                    dialect,
                    &Answer::Result(MethodResult::LandmarkIds(name, ErrorCode::OK, Sequence::Values(&ids))),
                );
            }
            Method::GetData { wait, mask } => {
                let promised = PromisedMethod::Data { wait: *wait, mask: *mask as u8 };
                return self.promise(dialect, name, promised, *wait, now, pending);
            }
            Method::GetPose { wait } => {
                let promised = PromisedMethod::Pose { wait: *wait };
                return self.promise(dialect, name, promised, *wait, now, pending);
            }
            Method::GetLandmarkData { wait, dataset } => {
                let promised = PromisedMethod::Landmarks { wait: *wait, dataset: *dataset };
                return self.promise(dialect, name, promised, *wait, now, pending);
            }
            Method::DoMapping => {
                return self.promise(dialect, name, PromisedMethod::Mapping, true, now, pending);
            }
            _ => MethodResult::Plain(name, Some(ErrorCode::OK)),
        };
        let result = encode(dialect, &Answer::Result(result));
        if name.is_slow() { self.accept(dialect, name, result, now, pending) } else { result }
    }

    /// An acknowledgement, and the result now or after the gap.
    pub(super) fn accept(
        &self,
        dialect: Dialect,
        name: MethodName,
        result: Vec<u8>,
        now: f64,
        pending: &mut Pending,
    ) -> Vec<u8> {
        let mut bytes = encode(dialect, &Answer::Accepted(name));
        if self.gap > 0.0 {
            pending.delay(now + self.gap, result);
        } else {
            bytes.extend(result);
        }
        bytes
    }
}

/// The value of a variable that nobody knows more of.
fn zero(dialect: Dialect, name: &str) -> Vec<u8> {
    let zero: &[u8] = if dialect == Dialect::Ascii { b"0" } else { b"\0" };
    encode(dialect, &Answer::Value(Value::Other(name, Raw { dialect, bytes: zero })))
}

pub(super) fn encode(dialect: Dialect, answer: &Answer) -> Vec<u8> {
    let mut buffer = vec![0; 1 << 17];
    match answer.encode(dialect, &mut buffer) {
        Ok(length) => buffer.truncate(length),
        Err(_) => return refuse(dialect, Fault(0x07)),
    }
    buffer
}

fn refuse(dialect: Dialect, fault: Fault) -> Vec<u8> {
    let mut buffer = vec![0; 32];
    let length = agv_wire::cola::Writer::fault(dialect, fault, &mut buffer).unwrap_or(0);
    buffer.truncate(length);
    buffer
}

/// Why a request could not be read.
fn why(dialect: Dialect, payload: &[u8]) -> Fault {
    match Telegram::parse(dialect, payload) {
        Ok(Telegram { command: CommandWord::Method, name, .. }) if MethodName::find(name).is_none() => {
            Fault::UNKNOWN_METHOD
        }
        Ok(Telegram { command: CommandWord::Write, name, .. }) if Variable::find(name).is_none() => {
            Fault::UNKNOWN_VARIABLE
        }
        Ok(Telegram { command, .. }) if command.is_request() => Fault::INVALID_DATA,
        _ => Fault::UNKNOWN_COMMAND,
    }
}

/// The setting without borrowed parts; None if it cannot be without.
fn owned(setting: &Setting) -> Option<Setting<'static>> {
    Some(match *setting {
        Setting::MutedSectors(_) => return None,
        Setting::CurrentLayer(value) => Setting::CurrentLayer(value),
        Setting::PoseDataFormat(value) => Setting::PoseDataFormat(value),
        Setting::LandmarkDataFormat(value) => Setting::LandmarkDataFormat(value),
        Setting::ScanDataFormat(value) => Setting::ScanDataFormat(value),
        Setting::SlidingMean(value) => Setting::SlidingMean(value),
        Setting::MapConfiguration(value) => Setting::MapConfiguration(value),
        Setting::ReflectorSize(value) => Setting::ReflectorSize(value),
        Setting::ReflectorType(value) => Setting::ReflectorType(value),
        Setting::IdentificationWindow(value) => Setting::IdentificationWindow(value),
        Setting::NearestReflectors(value) => Setting::NearestReflectors(value),
        Setting::ActionRadius(nearest, farthest) => Setting::ActionRadius(nearest, farthest),
        Setting::ReflectorThreshold(value) => Setting::ReflectorThreshold(value),
        Setting::LandmarkMatching(value) => Setting::LandmarkMatching(value),
        Setting::CoordinateOrientation(value) => Setting::CoordinateOrientation(value),
        Setting::HardwareTimeSync(mode, mask) => Setting::HardwareTimeSync(mode, mask),
        Setting::ColaDialect(value) => Setting::ColaDialect(value),
    })
}
