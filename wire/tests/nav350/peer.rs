//! A sensor that answers as it is told to, on a line with a delay, in a time that is only counted.

use std::collections::VecDeque;

use agv_core::measurement::Time;
use agv_wire::cola::{Deframed, Deframer, Dialect, Fault, Sequence, Text};
use agv_wire::nav350::{
    Answer, Channel, ChannelName, Configuration, Coordinate, CoordinateFormat, DeviceTime, ErrorCode, LandmarkData,
    LandmarkDataFormat, LostReason, Method, MethodName, MethodResult, Milliangle, NavigationData, OperatingMode,
    PoseDataFormat, Reflector, ReflectorDetails, ReflectorList, Report, Request, Revolution, ScanDataFormat, Session,
    Setting, Size, SpeedReport, State, Step, Value, Variable,
};

/// What the sensor does other than usual.
#[derive(Clone, Debug, Default)]
pub struct Moods {
    /// It understands this dialect only.
    pub only: Option<Dialect>,
    /// It does not grant the user level.
    pub refuses_access: bool,
    /// It refuses this variable.
    pub refuses_setting: Option<Variable>,
    /// It refuses this method.
    pub refuses_method: Option<MethodName>,
    /// It says nothing to this method.
    pub ignores_method: Option<MethodName>,
    /// Bytes before each answer.
    pub rubbish: Vec<u8>,
    /// The result of data comes this much after everything else, us.
    pub data_delay: u64,
    /// Data end with this error.
    pub data_error: Option<ErrorCode>,
    /// It says nothing when it is asked for this variable.
    pub hides_setting: Option<Variable>,
}

pub struct Scene {
    pub session: Session,
    pub revolution: Box<Revolution>,
    pub now: u64,
    /// Milliseconds that the sensor's clock is ahead.
    pub clock_offset: u64,
    /// How much slower the sensor's clock is.
    pub drift: f64,
    pub moods: Moods,
    /// One way, us.
    pub delay: u64,
    /// The line is cut: nothing passes and no connection opens.
    pub is_cut: bool,
    pub mode: OperatingMode,
    /// What it has been told, and its orientation if it has one.
    pub settings: Vec<Setting<'static>>,
    is_open: bool,
    deframer: Deframer,
    to_host: VecDeque<(u64, Vec<u8>)>,
    pub requests: Vec<Vec<u8>>,
    pub speeds: Vec<SpeedReport>,
    pub reports: Vec<(u64, Report)>,
    pub lost: Vec<(u64, LostReason)>,
    /// When a revolution arrived, and when its first beam really was.
    pub revolutions: Vec<(u64, u64)>,
    beam_starts: VecDeque<u64>,
    pub connects: Vec<u64>,
    /// Largest piece that the line carries.
    pub piece: usize,
}

pub const RANGES: [u32; 4] = [1000, 2000, 0, 70_000];

/// What nobody has set yet.
fn factory() -> Vec<Setting<'static>> {
    let coordinates = CoordinateFormat::Cartesian;
    vec![
        Setting::CurrentLayer(0),
        Setting::LandmarkDataFormat(LandmarkDataFormat { coordinates, has_details: false, filter: 0 }),
        Setting::ScanDataFormat(ScanDataFormat { channels: 1, has_remission: false }),
        Setting::PoseDataFormat(PoseDataFormat { is_extrapolated: false, has_details: false }),
        Setting::CoordinateOrientation(0),
    ]
}

impl Scene {
    pub fn new(configuration: Configuration) -> Self {
        Self {
            session: Session::new(configuration),
            revolution: Box::default(),
            now: 10_000_000,
            clock_offset: 123_456,
            drift: 0.0,
            moods: Moods::default(),
            delay: 300,
            is_cut: false,
            mode: OperatingMode::PowerDown,
            settings: factory(),
            is_open: false,
            deframer: Deframer::new(),
            to_host: VecDeque::new(),
            requests: Vec::new(),
            speeds: Vec::new(),
            reports: Vec::new(),
            lost: Vec::new(),
            revolutions: Vec::new(),
            beam_starts: VecDeque::new(),
            connects: Vec::new(),
            piece: usize::MAX,
        }
    }

    pub fn device_time(&self, micros: u64) -> DeviceTime {
        DeviceTime((self.clock_offset as f64 + micros as f64 * 1e-3 / (1.0 + self.drift)) as u64 as u32)
    }

    /// Bytes that come to the host without a question.
    pub fn inject(&mut self, bytes: &[u8]) {
        self.to_host.push_back((self.now, bytes.to_vec()));
    }

    pub fn cut(&mut self) {
        self.is_cut = true;
        self.is_open = false;
        self.to_host.clear();
        self.session.closed();
    }

    /// Lets the given time pass, s.
    pub fn run(&mut self, seconds: f64) {
        let end = self.now + (seconds * 1e6) as u64;
        // A conversation that never waits is one that never ends.
        for _ in 0..2_000_000 {
            let step = match self.session.poll(Time::from_micros(self.now), &mut self.revolution) {
                Step::Send(bytes) => Some(bytes.to_vec()),
                Step::Connect => {
                    self.connects.push(self.now);
                    self.open();
                    None
                }
                Step::Disconnect(reason) => {
                    self.lost.push((self.now, reason));
                    self.is_open = false;
                    self.to_host.clear();
                    self.beam_starts.clear();
                    None
                }
                Step::Revolution => {
                    let start = self.beam_starts.pop_front().unwrap();
                    self.revolutions.push((self.now, start));
                    None
                }
                Step::Report(report) => {
                    self.reports.push((self.now, report));
                    None
                }
                Step::Wait(until) => {
                    let arrival = self.to_host.iter().map(|(time, _)| *time).min().unwrap_or(u64::MAX);
                    let next = until.micros().min(arrival).max(self.now);
                    if next > end {
                        self.now = end;
                        return;
                    }
                    self.now = next;
                    self.deliver();
                    None
                }
            };
            if let Some(bytes) = step {
                self.serve(&bytes);
            }
        }
        panic!("the conversation never waits");
    }

    fn open(&mut self) {
        if self.is_cut {
            self.session.closed();
        } else {
            self.is_open = true;
            self.deframer.clear();
            self.session.connected(Time::from_micros(self.now));
        }
    }

    fn deliver(&mut self) {
        let Some(index) = self.to_host.iter().position(|(time, _)| *time <= self.now) else { return };
        let (_, bytes) = self.to_host.remove(index).unwrap();
        let (piece, rest) = bytes.split_at(bytes.len().min(self.piece));
        let taken = self.session.receive(piece, Time::from_micros(self.now));
        let rest = [&piece[taken..], rest].concat();
        if !rest.is_empty() {
            self.to_host.insert(index, (self.now, rest));
        }
    }

    fn serve(&mut self, bytes: &[u8]) {
        self.requests.push(bytes.to_vec());
        if self.is_cut || !self.is_open {
            return;
        }
        self.deframer.extend(bytes);
        let Some(Deframed::Telegram { dialect, payload, .. }) = self.deframer.next() else {
            panic!("the request is not framed")
        };
        let payload = payload.to_vec();
        if self.moods.only.is_some_and(|only| only != dialect) {
            return;
        }
        let request = Request::decode(dialect, &payload).unwrap();
        self.answer(dialect, &request);
    }

    fn say(&mut self, dialect: Dialect, answer: &Answer, after: u64) {
        let mut buffer = vec![0; 40_000];
        let length = answer.encode(dialect, &mut buffer).unwrap();
        let bytes = [&self.moods.rubbish, &buffer[..length]].concat();
        self.to_host.push_back((self.now + 2 * self.delay + after, bytes));
    }

    fn answer(&mut self, dialect: Dialect, request: &Request) {
        match request {
            Request::Read(Variable::DeviceIdent) => {
                let ident = Value::DeviceIdent(Text(b"NAV350"), Text(b"V1.0"));
                self.say(dialect, &Answer::Value(ident), 0);
            }
            Request::Read(variable) if self.moods.hides_setting == Some(*variable) => {}
            Request::Read(variable) => {
                let known = self.settings.iter().find(|setting| setting.variable() == *variable);
                let answer =
                    known.map_or(Answer::Fault(Fault::UNKNOWN_VARIABLE), |known| Answer::Value(Value::Setting(*known)));
                self.say(dialect, &answer, 0);
            }
            Request::ReadOther(_) => self.say(dialect, &Answer::Fault(Fault::UNKNOWN_VARIABLE), 0),
            Request::Write(setting) if self.moods.refuses_setting == Some(setting.variable()) => {
                self.say(dialect, &Answer::Fault(Fault::LOCAL_CONDITION), 0);
            }
            Request::Write(setting) => {
                let owned = match *setting {
                    Setting::CurrentLayer(layer) => Setting::CurrentLayer(layer),
                    Setting::LandmarkDataFormat(format) => Setting::LandmarkDataFormat(format),
                    Setting::ScanDataFormat(format) => Setting::ScanDataFormat(format),
                    Setting::PoseDataFormat(format) => Setting::PoseDataFormat(format),
                    Setting::CoordinateOrientation(orientation) => Setting::CoordinateOrientation(orientation),
                    ref other => panic!("the session never writes {other:?}"),
                };
                self.settings.retain(|known| known.variable() != owned.variable());
                self.settings.push(owned);
                self.say(dialect, &Answer::Written(owned.variable()), 0);
            }
            Request::Call(method) if self.moods.ignores_method == Some(method.name()) => {}
            Request::Call(method) if self.moods.refuses_method == Some(method.name()) => {
                self.say(dialect, &Answer::Fault(Fault::LOCAL_CONDITION), 0);
            }
            Request::Call(method) => self.call(dialect, method),
        }
    }

    fn call(&mut self, dialect: Dialect, method: &Method) {
        let result = match method {
            Method::SetAccessMode { level, password } => {
                let is_granted = (*level, *password) == (3, 0xF472_4744) && !self.moods.refuses_access;
                MethodResult::AccessMode(is_granted)
            }
            Method::ChangeState(mode) => {
                self.mode = *mode;
                MethodResult::State(ErrorCode::OK, Some(*mode))
            }
            Method::GetTimestamp => MethodResult::Timestamp(ErrorCode::OK, self.device_time(self.now + self.delay)),
            Method::SetSpeed(speed) => {
                self.speeds.push(*speed);
                MethodResult::Plain(MethodName::SetSpeed, Some(ErrorCode::OK))
            }
            Method::GetData { .. } | Method::GetLandmarkData { .. } => return self.data(dialect, method.name()),
            other => panic!("the session never calls {other:?}"),
        };
        if method.name().is_slow() {
            self.say(dialect, &Answer::Accepted(method.name()), 0);
        }
        self.say(dialect, &Answer::Result(result), 0);
    }

    fn data(&mut self, dialect: Dialect, method: MethodName) {
        self.say(dialect, &Answer::Accepted(method), 0);
        let is_landmarks = method == MethodName::GetLandmarkData;
        let needed = if is_landmarks { OperatingMode::LandmarkDetection } else { OperatingMode::Navigation };
        let is_right = self.mode == needed;
        let error = if is_right { self.moods.data_error.unwrap_or(ErrorCode::OK) } else { ErrorCode::WRONG_MODE };
        // The revolution that ends next.
        let end = (self.now / 125_000 + 1) * 125_000;
        let start = end - 125_000;
        let time = self.device_time(start + 50_000);
        let reflector = Reflector {
            cartesian: Some((Coordinate(3000), Coordinate(4000))),
            polar: None,
            details: Some(ReflectorDetails {
                local_id: 0,
                global_id: 7,
                kind: 1,
                subtype: 2,
                quality: 100,
                time,
                size: Size(80),
                hit_count: 9,
                mean_echo: 500,
                start_index: 1438,
                end_index: 2,
            }),
        };
        let reflectors = [reflector];
        let distances = Channel {
            name: ChannelName::DISTANCE,
            scale: 1.0,
            offset: 0.0,
            first: Milliangle(0),
            resolution: 250,
            start: self.device_time(start),
            samples: Sequence::Values(&RANGES),
        };
        let has_data = matches!(error, ErrorCode::OK | ErrorCode::NO_POSITION);
        let reflectors = has_data.then_some(ReflectorList { filter: 1, reflectors: Sequence::Values(&reflectors) });
        let channels = if has_data { [distances].into_iter().collect() } else { heapless::Vec::new() };
        let (version, wait, remission) = (1, 1, None);
        let result = if is_landmarks {
            let data = LandmarkData { version, error, wait, dataset: 2, reflectors, channels, remission };
            MethodResult::LandmarkData(data)
        } else {
            let data = NavigationData { version, error, wait, mask: 2, pose: None, reflectors, channels, remission };
            MethodResult::Data(data)
        };
        if has_data {
            self.beam_starts.push_back(start);
        }
        let after = end - self.now + self.moods.data_delay;
        self.say(dialect, &Answer::Result(result), after);
    }

    pub fn has(&self, report: Report) -> bool {
        self.reports.iter().any(|(_, told)| *told == report)
    }

    pub fn is_running(&self) -> bool {
        self.session.state() == State::Running
    }
}
