//! A NAV350 on TCP that sees what a recorded or simulated drive has seen.
//!
//! It speaks both dialects, has the sensor's operating modes, user levels, settings and layout, and answers the reads
//! that its maker's client makes at start-up. The drive begins with the first question for data, or when it is told to;
//! until then the first revolution is repeated, and the last one when it is over.

use std::io::{self, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use agv_core::geometry::Pose;
use agv_core::measurement::{ReflectorObservation, Time};
use agv_core::wire::cola::{CommandWord, Deframed, Deframer, Dialect, Fault, Raw, Sequence, Telegram, Text};
use agv_core::wire::nav350::{
    Angle, Answer, Channel, ChannelName, Coordinate, CoordinateFormat, DeviceTime, Distance, ErrorCode,
    IdentifiedLandmark, LandmarkData, LandmarkDataFormat, MapConfiguration, Method, MethodName, MethodResult,
    Milliangle, NavigationData, OperatingMode, PoseAnswer, PoseDataFormat, PoseDetails, PoseReport, PositionMode,
    Reflector, ReflectorDetails, ReflectorList, ReflectorType, Request, ScanDataFormat, SensorFrame, Setting, Size,
    SpeedReport, UserLevel, Value, Variable,
};

use crate::layout_file;
use crate::recording::{RecordedEvent, RecordedScan, Recording};

/// What the sensor measured in one turn.
#[derive(Clone, Debug, PartialEq)]
pub struct Turn {
    /// When its first beam was measured, in the time of the drive.
    pub start: Time,
    /// Range of each beam, mm.
    pub ranges: Vec<u32>,
    /// Strength of each echo, or empty.
    pub remission: Vec<u16>,
    /// Direction of the first beam.
    pub first: Milliangle,
    /// Angle between beams, thousandths of a degree.
    pub resolution: u16,
    /// Reflectors.
    pub reflectors: Vec<ReflectorObservation>,
    /// True pose of S at the end.
    pub pose: Option<Pose>,
}

/// What the sensor will see.
#[derive(Clone, Debug)]
pub struct Drive {
    turns: Vec<Turn>,
    layout: Vec<IdentifiedLandmark>,
    frame: SensorFrame,
}

/// Why a recording cannot be served.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DriveError {
    /// It has no scans and no reflectors.
    #[error("the drive has neither scans nor reflectors")]
    Empty,
}

fn millimetres(range: f32) -> u32 {
    Distance::from_metres(f64::from(range)).0
}

impl Drive {
    /// The scans and reflectors of a recording, turn by turn.
    ///
    /// # Errors
    /// If it has neither.
    pub fn new(recording: &Recording, frame: SensorFrame) -> Result<Self, DriveError> {
        let mut turns: Vec<Turn> = Vec::new();
        let empty = |start| Turn {
            start,
            ranges: Vec::new(),
            remission: Vec::new(),
            first: Milliangle(0),
            resolution: 250,
            reflectors: Vec::new(),
            pose: None,
        };
        for event in &recording.events {
            let RecordedEvent::Scan(scan) = event else { continue };
            let RecordedScan { start, first_bearing, bearing_step, ranges, intensities, .. } = scan;
            turns.push(Turn {
                ranges: ranges.iter().copied().map(millimetres).collect(),
                remission: intensities.clone(),
                first: Milliangle::from_radians(agv_core::geometry::wrap(frame.angle(*first_bearing))),
                resolution: Milliangle::from_radians(bearing_step.abs()).0.try_into().unwrap_or(u16::MAX),
                ..empty(*start)
            });
        }
        let has_scans = !turns.is_empty();
        turns.sort_by_key(|turn| turn.start);
        for event in &recording.events {
            let RecordedEvent::Reflectors(observations) = event else { continue };
            let Some(first) = observations.first() else { continue };
            if has_scans {
                let index = turns.partition_point(|turn| turn.start <= first.time).saturating_sub(1);
                turns[index].reflectors.extend(observations);
            } else {
                turns.push(Turn { reflectors: observations.clone(), ..empty(first.time) });
            }
        }
        for turn in &mut turns {
            let end = turn.start.offset(frame.period);
            let index = recording.truth.partition_point(|truth| truth.time <= end);
            let truth = recording.truth.get(index.saturating_sub(1));
            turn.pose = truth.map(|truth| truth.pose.compose(&recording.parameters.laser));
        }
        let layout = layout_file::layout(&recording.landmarks);
        if turns.is_empty() { Err(DriveError::Empty) } else { Ok(Self { turns, layout, frame }) }
    }

    /// What the sensor will see, turn by turn.
    #[must_use]
    pub fn turns(&self) -> &[Turn] {
        &self.turns
    }

    fn first_start(&self) -> Time {
        self.turns.first().map_or(Time::default(), |turn| turn.start)
    }
}

/// How the sensor behaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// How much faster than real time the drive goes.
    pub speed: f64,
    /// What the sensor's clock shows at its start, ms.
    pub clock_start: u32,
    /// The only dialect that is understood; both if None.
    pub dialect: Option<Dialect>,
    /// Whether the vehicle stands until [`Nav350::begin`].
    pub stands: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self { speed: 1.0, clock_start: 0, dialect: None, stands: false }
    }
}

/// An emulated sensor.
pub struct Nav350 {
    drive: Drive,
    options: Options,
    started: Instant,
    state: Mutex<State>,
}

/// What changes.
struct State {
    mode: OperatingMode,
    level: u8,
    layout: Vec<IdentifiedLandmark>,
    settings: Vec<Setting<'static>>,
    speed: Option<SpeedReport>,
    /// When the drive began, in seconds of the sensor since its start.
    drive_start: Option<f64>,
}

/// A question that is answered later.
#[derive(Clone, Copy)]
struct Promise {
    due: f64,
    turn: usize,
    /// When the first turn began, had every turn been made once, s.
    start: f64,
    method: PromisedMethod,
    dialect: Dialect,
}

#[derive(Clone, Copy)]
enum PromisedMethod {
    Data { wait: bool, mask: u8 },
    Pose { wait: bool },
    Landmarks { wait: bool, dataset: u8 },
    Mapping,
}

impl Nav350 {
    /// A sensor that was just started.
    #[must_use]
    pub fn new(drive: Drive, options: Options) -> Self {
        let settings = vec![
            Setting::CurrentLayer(0),
            Setting::PoseDataFormat(PoseDataFormat { is_extrapolated: false, has_details: false }),
            Setting::LandmarkDataFormat(LandmarkDataFormat {
                coordinates: CoordinateFormat::Cartesian,
                has_details: false,
                filter: 0,
            }),
            Setting::ScanDataFormat(ScanDataFormat { channels: 1, has_remission: false }),
            Setting::SlidingMean(4),
            Setting::MapConfiguration(MapConfiguration {
                mean: 10,
                only_unknown: false,
                x: Coordinate(0),
                y: Coordinate(0),
                heading: Milliangle(0),
            }),
            Setting::ReflectorSize(Size(80)),
            Setting::ReflectorType(ReflectorType::Cylindrical),
            Setting::NearestReflectors(0),
        ];
        let state = State {
            mode: OperatingMode::PowerDown,
            level: 0,
            layout: drive.layout.clone(),
            settings,
            speed: None,
            drive_start: None,
        };
        Self { drive, options, started: Instant::now(), state: Mutex::new(state) }
    }

    /// The speed that the sensor was told last.
    #[must_use]
    pub fn speed(&self) -> Option<SpeedReport> {
        self.state().speed
    }

    /// The layout as it is now.
    #[must_use]
    pub fn layout(&self) -> Vec<IdentifiedLandmark> {
        self.state().layout.clone()
    }

    /// Lets the vehicle of a sensor that stands drive off at `time`.
    pub fn begin(&self, time: Instant) {
        let seconds = time.saturating_duration_since(self.started).as_secs_f64() * self.options.speed;
        self.state().drive_start = Some(seconds);
    }

    /// Serves every connection, until `is_stopped`.
    ///
    /// # Errors
    /// If the listener fails.
    pub fn serve(&self, listener: &TcpListener, is_stopped: &AtomicBool) -> io::Result<()> {
        listener.set_nonblocking(true)?;
        std::thread::scope(|scope| {
            while !is_stopped.load(Ordering::Relaxed) {
                match listener.accept() {
                    Ok((stream, _)) => {
                        scope.spawn(move || {
                            // A connection that fails is the client's affair.
                            let _ = self.converse(stream, is_stopped);
                        });
                    }
                    Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                        std::thread::sleep(Duration::from_millis(5));
                    }
                    Err(error) => return Err(error),
                }
            }
            Ok(())
        })
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Seconds of the sensor since its start.
    fn now(&self) -> f64 {
        self.started.elapsed().as_secs_f64() * self.options.speed
    }

    fn device_time(&self, seconds: f64) -> DeviceTime {
        let milliseconds = (seconds * 1e3).floor() as i64;
        DeviceTime(self.options.clock_start.wrapping_add(milliseconds as u32))
    }

    fn converse(&self, mut stream: TcpStream, is_stopped: &AtomicBool) -> io::Result<()> {
        stream.set_nonblocking(false)?;
        stream.set_nodelay(true)?;
        let mut deframer = Box::new(Deframer::<65_536>::new());
        let mut buffer = vec![0; 1 << 16];
        let mut promise: Option<Promise> = None;
        while !is_stopped.load(Ordering::Relaxed) {
            let mut patience = 0.02;
            if let Some(kept) = promise {
                let wait = (kept.due - self.now()) / self.options.speed;
                if wait <= 0.0 {
                    promise = None;
                    stream.write_all(&self.keep(&kept))?;
                    continue;
                }
                patience = wait.min(patience);
            }
            stream.set_read_timeout(Some(Duration::from_secs_f64(patience.max(1e-4))))?;
            let count = match stream.read(&mut buffer) {
                Ok(0) => return Ok(()),
                Ok(count) => count,
                Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => continue,
                Err(error) => return Err(error),
            };
            let mut rest = &buffer[..count];
            while !rest.is_empty() {
                let taken = deframer.extend(rest);
                rest = &rest[taken..];
                while let Some(found) = deframer.next() {
                    let Deframed::Telegram { dialect, payload, .. } = found else { continue };
                    if self.options.dialect.is_none_or(|only| only == dialect) {
                        stream.write_all(&self.answer(dialect, payload, &mut promise))?;
                    }
                }
            }
        }
        Ok(())
    }

    /// The bytes that answer a payload at once.
    fn answer(&self, dialect: Dialect, payload: &[u8], promise: &mut Option<Promise>) -> Vec<u8> {
        match Request::decode(dialect, payload) {
            Ok(Request::Read(variable)) => self.read(dialect, variable),
            Ok(Request::ReadOther(name)) => {
                let zero: &[u8] = if dialect == Dialect::Ascii { b"0" } else { b"\0" };
                encode(dialect, &Answer::Value(Value::Other(name, Raw { dialect, bytes: zero })))
            }
            Ok(Request::Write(setting)) => self.write(dialect, &setting),
            Ok(Request::Call(method)) => self.call(dialect, &method, promise),
            Err(_) => refuse(dialect, why(dialect, payload)),
        }
    }

    fn read(&self, dialect: Dialect, variable: Variable) -> Vec<u8> {
        let text = |text: &'static str| Text(text.as_bytes());
        let value = match variable {
            Variable::DeviceIdent => Value::DeviceIdent(text("NAV350"), text("emulated")),
            Variable::SerialNumber => Value::SerialNumber(text("00000000")),
            Variable::FirmwareVersion => Value::FirmwareVersion(text("emulated")),
            _ => {
                let state = self.state();
                match state.settings.iter().find(|setting| setting.variable() == variable) {
                    Some(setting) => Value::Setting(*setting),
                    None => return refuse(dialect, Fault::UNKNOWN_VARIABLE),
                }
            }
        };
        encode(dialect, &Answer::Value(value))
    }

    fn write(&self, dialect: Dialect, setting: &Setting) -> Vec<u8> {
        let variable = setting.variable();
        let mut state = self.state();
        if let Setting::ColaDialect(_) = setting {
            return encode(dialect, &Answer::Written(variable));
        }
        if state.level < UserLevel::AuthorisedClient.number() {
            return refuse(dialect, Fault::ACCESS_DENIED);
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
        state.settings.retain(|known| known.variable() != variable);
        state.settings.push(owned);
        encode(dialect, &Answer::Written(variable))
    }

    fn call(&self, dialect: Dialect, method: &Method, promise: &mut Option<Promise>) -> Vec<u8> {
        let name = method.name();
        let mut state = self.state();
        let needs_level = !matches!(
            name,
            MethodName::SetAccessMode
                | MethodName::GetTimestamp
                | MethodName::GetData
                | MethodName::GetPose
                | MethodName::GetLandmarkData
                | MethodName::GetLandmarks
                | MethodName::GetLayer
                | MethodName::GetLayout
                | MethodName::SetSpeed
        );
        if needs_level && state.level < UserLevel::AuthorisedClient.number() {
            return refuse(dialect, Fault::ACCESS_DENIED);
        }
        let is_editable = matches!(state.mode, OperatingMode::Standby | OperatingMode::Mapping);
        let edit_error = if is_editable { ErrorCode::OK } else { ErrorCode::WRONG_MODE };
        let result = match method {
            Method::SetAccessMode { level, password } => {
                let levels = [UserLevel::Maintenance, UserLevel::AuthorisedClient, UserLevel::Service];
                let is_granted =
                    levels.iter().any(|known| (known.number(), known.default_password()) == (*level, *password));
                if is_granted {
                    state.level = *level;
                }
                MethodResult::AccessMode(is_granted)
            }
            Method::ChangeState(mode) => {
                state.mode = *mode;
                MethodResult::State(ErrorCode::OK, Some(*mode))
            }
            Method::GetTimestamp => MethodResult::Timestamp(ErrorCode::OK, self.device_time(self.now())),
            Method::SetSpeed(speed) => {
                let is_right = state.mode == OperatingMode::Navigation;
                state.speed = is_right.then_some(*speed).or(state.speed);
                let error = if is_right { ErrorCode::OK } else { ErrorCode::WRONG_MODE };
                MethodResult::Plain(name, Some(error))
            }
            Method::EraseLayout(_) => {
                if is_editable {
                    state.layout.clear();
                }
                MethodResult::Plain(name, Some(edit_error))
            }
            Method::AddLandmarks(landmarks) => {
                let mut ids = Vec::new();
                if is_editable {
                    for landmark in landmarks.iter() {
                        let id = state.layout.iter().map(|known| known.id + 1).max().unwrap_or(0);
                        state.layout.push(IdentifiedLandmark { id, landmark });
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
                        match state.layout.iter_mut().find(|known| known.id == landmark.id) {
                            Some(known) => *known = landmark,
                            None => state.layout.push(landmark),
                        }
                    }
                }
                MethodResult::Plain(name, Some(edit_error))
            }
            Method::DeleteLandmarks(ids) => {
                if is_editable {
                    state.layout.retain(|known| !ids.iter().any(|id| id == known.id));
                }
                MethodResult::Plain(name, Some(edit_error))
            }
            Method::GetLandmarks(ids) => {
                let wanted: Vec<_> =
                    ids.iter().filter_map(|id| state.layout.iter().find(|known| known.id == id).cloned()).collect();
                let error = if wanted.len() == ids.len() { ErrorCode::OK } else { ErrorCode::INVALID_DATA };
                return encode(dialect, &Answer::Result(MethodResult::Landmarks(error, Sequence::Values(&wanted))));
            }
            Method::GetLayer(_) | Method::GetLayout => {
                let ids: Vec<u16> = state
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
                return self.promise(dialect, name, promised, *wait, &mut state, promise);
            }
            Method::GetPose { wait } => {
                let promised = PromisedMethod::Pose { wait: *wait };
                return self.promise(dialect, name, promised, *wait, &mut state, promise);
            }
            Method::GetLandmarkData { wait, dataset } => {
                let promised = PromisedMethod::Landmarks { wait: *wait, dataset: *dataset };
                return self.promise(dialect, name, promised, *wait, &mut state, promise);
            }
            Method::DoMapping => {
                return self.promise(dialect, name, PromisedMethod::Mapping, true, &mut state, promise);
            }
            _ => MethodResult::Plain(name, Some(ErrorCode::OK)),
        };
        let mut bytes = Vec::new();
        if name.is_slow() {
            bytes = encode(dialect, &Answer::Accepted(name));
        }
        bytes.extend(encode(dialect, &Answer::Result(result)));
        bytes
    }

    /// Accepts a slow method, to be answered at the end of a turn.
    fn promise(
        &self,
        dialect: Dialect,
        name: MethodName,
        method: PromisedMethod,
        wait: bool,
        state: &mut State,
        promise: &mut Option<Promise>,
    ) -> Vec<u8> {
        let mut bytes = encode(dialect, &Answer::Accepted(name));
        if promise.is_some() {
            bytes.extend(self.failure(dialect, method, ErrorCode::ALREADY_ACTIVE));
            return bytes;
        }
        let needed = match method {
            PromisedMethod::Data { .. } | PromisedMethod::Pose { .. } => OperatingMode::Navigation,
            PromisedMethod::Landmarks { .. } => OperatingMode::LandmarkDetection,
            PromisedMethod::Mapping => OperatingMode::Mapping,
        };
        if state.mode != needed {
            bytes.extend(self.failure(dialect, method, ErrorCode::WRONG_MODE));
            return bytes;
        }
        let now = self.now();
        let period = self.drive.frame.period;
        if self.options.stands && state.drive_start.is_none_or(|start| now < start) {
            let periods = (now / period).floor() + if wait { 1.0 } else { 0.0 };
            let due = if wait { periods * period } else { now };
            *promise = Some(Promise { due, turn: 0, start: (periods - 1.0) * period, method, dialect });
            return bytes;
        }
        let drive_start = *state.drive_start.get_or_insert(now);
        let end = |turn: &Turn| drive_start + turn.start.since(self.drive.first_start()) + period;
        let mut turn = self.drive.turns.partition_point(|turn| end(turn) <= now);
        if !wait {
            turn = turn.saturating_sub(1);
        }
        let last = self.drive.turns.len() - 1;
        let (turn, shift) = if turn <= last {
            (turn, 0.0)
        } else {
            let periods = ((now - end(&self.drive.turns[last])) / period).floor() + 1.0;
            (last, periods * period)
        };
        let due = if wait { end(&self.drive.turns[turn]) + shift } else { now };
        *promise = Some(Promise { due, turn, start: drive_start + shift, method, dialect });
        bytes
    }

    fn failure(&self, dialect: Dialect, method: PromisedMethod, error: ErrorCode) -> Vec<u8> {
        encode_result(dialect, method, error, None, None, heapless::Vec::new(), None)
    }

    /// The answer that was promised.
    fn keep(&self, promise: &Promise) -> Vec<u8> {
        let state = self.state();
        let turn = &self.drive.turns[promise.turn];
        let time = |time: Time| self.device_time(time.since(self.drive.first_start()) + promise.start);
        let mut pose_details = false;
        let mut landmarks =
            LandmarkDataFormat { coordinates: CoordinateFormat::Cartesian, has_details: false, filter: 0 };
        let (mut has_remission, mut has_angles) = (false, false);
        for setting in &state.settings {
            match setting {
                Setting::PoseDataFormat(format) => pose_details = format.has_details,
                Setting::LandmarkDataFormat(format) => landmarks = *format,
                // One mode has distances only, another one directions too; its number is not documented.
                Setting::ScanDataFormat(format) => {
                    (has_remission, has_angles) = (format.has_remission, format.channels != 1);
                }
                _ => {}
            }
        }
        let frame = &self.drive.frame;
        let reflectors: Vec<Reflector> = turn
            .reflectors
            .iter()
            .zip(0_u16..)
            .map(|(observation, local_id)| {
                let angle = frame.angle(f64::from(observation.bearing));
                let range = f64::from(observation.range);
                let is_polar = landmarks.coordinates == CoordinateFormat::Polar;
                let cartesian = (
                    Coordinate::from_metres(range * libm::cos(angle)),
                    Coordinate::from_metres(range * libm::sin(angle)),
                );
                Reflector {
                    cartesian: (!is_polar).then_some(cartesian),
                    polar: is_polar.then(|| (Distance::from_metres(range), Angle::from_radians(angle))),
                    details: landmarks.has_details.then(|| ReflectorDetails {
                        local_id,
                        global_id: u16::MAX,
                        kind: 1,
                        subtype: 2,
                        quality: 100,
                        time: time(observation.time),
                        size: Size(80),
                        hit_count: 1,
                        mean_echo: 0,
                        start_index: 0,
                        end_index: 0,
                    }),
                }
            })
            .collect();
        let end = turn.start.offset(frame.period);
        let pose = turn.pose.map(|pose| PoseReport {
            x: Coordinate::from_metres(pose.x),
            y: Coordinate::from_metres(pose.y),
            heading: Angle::from_radians(pose.theta + frame.step(frame.zero)),
            details: pose_details.then(|| PoseDetails {
                output_mode: 0,
                time: time(end),
                mean_deviation: 0,
                mode: PositionMode::Continuous,
                info: 0,
                used_reflectors: u8::try_from(reflectors.len()).unwrap_or(u8::MAX),
            }),
        });
        let distances = Channel {
            name: ChannelName::DISTANCE,
            scale: 1.0,
            offset: 0.0,
            first: turn.first,
            resolution: turn.resolution,
            start: time(turn.start),
            samples: Sequence::Values(&turn.ranges),
        };
        let directions: Vec<u32> = (0..turn.ranges.len() as i64)
            .filter(|_| has_angles)
            .map(|beam| 10 * (i64::from(turn.first.0) + beam * i64::from(turn.resolution)).rem_euclid(360_000) as u32)
            .collect();
        let angles = Channel { name: ChannelName::ANGLE, samples: Sequence::Values(&directions), ..distances };
        let remission = Channel {
            name: ChannelName::REMISSION,
            scale: 1.0,
            offset: 0.0,
            first: turn.first,
            resolution: turn.resolution,
            start: time(turn.start),
            samples: Sequence::Values(&turn.remission),
        };
        let (wants_reflectors, wants_scan) = match promise.method {
            PromisedMethod::Data { mask, .. } => (mask != 1, mask != 0),
            PromisedMethod::Landmarks { dataset, .. } => (dataset != 1, dataset != 0),
            PromisedMethod::Pose { .. } | PromisedMethod::Mapping => (true, false),
        };
        let wants_scan = wants_scan && !turn.ranges.is_empty();
        let wants_remission = wants_scan && has_remission && !turn.remission.is_empty();
        let list = ReflectorList { filter: landmarks.filter, reflectors: Sequence::Values(&reflectors) };
        let error =
            if pose.is_some() || !matches!(promise.method, PromisedMethod::Data { .. } | PromisedMethod::Pose { .. }) {
                ErrorCode::OK
            } else {
                ErrorCode::NO_POSITION
            };
        encode_result(
            promise.dialect,
            promise.method,
            error,
            pose,
            wants_reflectors.then_some(list),
            [(wants_scan, distances), (wants_scan && has_angles, angles)]
                .into_iter()
                .filter_map(|(is_wanted, channel)| is_wanted.then_some(channel))
                .collect(),
            wants_remission.then_some(remission),
        )
    }
}

fn encode_result(
    dialect: Dialect,
    method: PromisedMethod,
    error: ErrorCode,
    pose: Option<PoseReport>,
    reflectors: Option<ReflectorList>,
    channels: heapless::Vec<Channel<u32>, 2>,
    remission: Option<Channel<u16>>,
) -> Vec<u8> {
    let version = 1;
    let result = match method {
        PromisedMethod::Data { wait, mask } => MethodResult::Data(NavigationData {
            version,
            error,
            wait: wait.into(),
            mask,
            pose,
            reflectors,
            channels,
            remission,
        }),
        PromisedMethod::Landmarks { wait, dataset } => MethodResult::LandmarkData(LandmarkData {
            version,
            error,
            wait: wait.into(),
            dataset,
            reflectors,
            channels,
            remission,
        }),
        PromisedMethod::Pose { wait } => MethodResult::Pose(PoseAnswer { version, error, wait: wait.into(), pose }),
        PromisedMethod::Mapping => MethodResult::Mapping(error, reflectors),
    };
    encode(dialect, &Answer::Result(result))
}

fn encode(dialect: Dialect, answer: &Answer) -> Vec<u8> {
    let mut buffer = vec![0; 1 << 17];
    match answer.encode(dialect, &mut buffer) {
        Ok(length) => buffer.truncate(length),
        Err(_) => return refuse(dialect, Fault(0x07)),
    }
    buffer
}

fn refuse(dialect: Dialect, fault: Fault) -> Vec<u8> {
    let mut buffer = vec![0; 32];
    let length = agv_core::wire::cola::Writer::fault(dialect, fault, &mut buffer).unwrap_or(0);
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
