//! The conversation with one sensor, without sockets and without a clock.

use core::fmt;

use heapless::{Deque, Vec};

use super::{
    Answer, ClockError, CoordinateFormat, DataMask, ErrorCode, LandmarkDataFormat, Method, MethodName, MethodResult,
    OperatingMode, PoseDataFormat, Request, Revolution, RevolutionError, ScanDataFormat, SensorClock, SensorFrame,
    SensorSpeed, Setting, UserLevel, Value, Variable,
};
use crate::cola::{BUFFER, Deframed, Deframer, Dialect, Fault, ReadError};
use agv_core::measurement::Time;

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

/// How far the conversation is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Not connected, before the next attempt.
    Waiting,
    /// The connection is being opened.
    Connecting,
    /// Which dialect the sensor speaks is being found.
    Identifying,
    /// The user level is being raised.
    LoggingIn,
    /// The settings are being written.
    Configuring,
    /// The operating mode is being changed.
    EnteringMode,
    /// The sensor's clock is being found.
    Synchronising,
    /// Revolutions arrive.
    Running,
}

/// Why a connection was given up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LostReason {
    /// It could not be opened.
    NotConnected,
    /// The other side, or the network, has closed it.
    Closed,
    /// No answer came in time.
    NoAnswer(State),
    /// The sensor does not grant the user level.
    AccessDenied,
    /// The sensor refuses what it must do.
    Refused(State, Fault),
    /// A method failed that must not.
    Failed(MethodName, ErrorCode),
    /// More bytes came than a telegram can have.
    Overflow,
}

impl fmt::Display for State {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Waiting => "waiting",
            Self::Connecting => "connecting",
            Self::Identifying => "identifying",
            Self::LoggingIn => "logging in",
            Self::Configuring => "configuring",
            Self::EnteringMode => "entering the operating mode",
            Self::Synchronising => "synchronising",
            Self::Running => "running",
        })
    }
}

impl fmt::Display for LostReason {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotConnected => write!(formatter, "no connection"),
            Self::Closed => write!(formatter, "the connection was closed"),
            Self::NoAnswer(state) => write!(formatter, "no answer while {state}"),
            Self::AccessDenied => write!(formatter, "the user level was not granted"),
            Self::Refused(state, fault) => write!(formatter, "refused while {state}: {fault}"),
            Self::Failed(method, error) => write!(formatter, "{} failed: {error}", method.name()),
            Self::Overflow => write!(formatter, "a telegram was too long"),
        }
    }
}

/// Something worth telling.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Report {
    /// The conversation has come to this state.
    State(State),
    /// The sensor speaks this dialect.
    Dialect(Dialect),
    /// So many bytes belonged to no telegram.
    Rubbish(usize),
    /// A telegram could not be read.
    Undecodable(ReadError),
    /// A telegram answered no question.
    Unexpected,
    /// A setting was refused; the sensor keeps what it had.
    SettingRefused(Variable, Fault),
    /// A call was refused.
    CallRefused(MethodName, Fault),
    /// A call was not answered in time.
    CallUnanswered(MethodName),
    /// A method failed.
    MethodFailed(MethodName, ErrorCode),
    /// An exchange of times was not usual.
    Clock(ClockError),
    /// An answer did not become a revolution.
    Revolution(RevolutionError),
}

impl fmt::Display for Report {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::State(state) => write!(formatter, "{state}"),
            Self::Dialect(Dialect::Ascii) => write!(formatter, "the sensor speaks CoLa-A"),
            Self::Dialect(Dialect::Binary) => write!(formatter, "the sensor speaks CoLa-B"),
            Self::Rubbish(count) => write!(formatter, "{count} bytes belong to no telegram"),
            Self::Undecodable(error) => write!(formatter, "a telegram cannot be read: {error:?}"),
            Self::Unexpected => write!(formatter, "a telegram answers no question"),
            Self::SettingRefused(variable, fault) => write!(formatter, "{} was refused: {fault}", variable.name()),
            Self::CallRefused(method, fault) => write!(formatter, "{} was refused: {fault}", method.name()),
            Self::CallUnanswered(method) => write!(formatter, "{} was not answered", method.name()),
            Self::MethodFailed(method, error) => write!(formatter, "{} failed: {error}", method.name()),
            Self::Clock(ClockError::RoundTrip) => write!(formatter, "an answer about the time came too late"),
            Self::Clock(ClockError::Restarted) => write!(formatter, "the sensor's clock was started again"),
            Self::Revolution(error) => write!(formatter, "a revolution cannot be used: {error:?}"),
        }
    }
}

/// What the caller must do next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step<'a> {
    /// Open the connection, then call [`Session::connected`] or [`Session::closed`].
    Connect,
    /// Close the connection.
    Disconnect(LostReason),
    /// Send these bytes.
    Send(&'a [u8]),
    /// The revolution was filled.
    Revolution,
    /// Take notice.
    Report(Report),
    /// Nothing until this time, unless bytes arrive.
    Wait(Time),
}

/// What a question is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Subject {
    Identity,
    Setting(Variable),
    Method(MethodName),
}

/// A question without an answer yet.
#[derive(Clone, Copy, Debug)]
struct Question {
    subject: Subject,
    sent: Time,
    deadline: Time,
    is_accepted: bool,
}

/// Length of the longest request that a session sends, with room to spare.
const REQUEST: usize = 128;
/// Questions that can be open at once: data, speed, time.
const QUESTIONS: usize = 4;
/// Reports that wait to be fetched; later ones are dropped.
const REPORTS: usize = 8;

/// The conversation with one sensor: bytes and times in, bytes, revolutions and reports out. `N` is the room for
/// received bytes.
///
/// The caller does what [`poll`](Self::poll) says until it says [`Step::Wait`], then waits for that time or for bytes,
/// whatever comes first.
#[derive(Clone, Debug)]
pub struct Session<const N: usize = BUFFER> {
    deframer: Deframer<N>,
    received: Time,
    request: [u8; REQUEST],
    conversation: Conversation,
}

#[derive(Clone, Debug)]
struct Conversation {
    configuration: Configuration,
    state: State,
    dialect: Dialect,
    /// Which telegram of the start-up is next.
    stage: usize,
    has_changed_dialect: bool,
    questions: Vec<Question, QUESTIONS>,
    clock: SensorClock,
    /// When the state [`State::Waiting`] or [`State::Connecting`] ends.
    until: Time,
    pause: f64,
    lost: Option<LostReason>,
    reports: Deque<Report, REPORTS>,
    polled: Option<Time>,
    asked_clock: Option<Time>,
    speed: Option<SensorSpeed>,
    sent_speed: Option<Time>,
}

impl<const N: usize> Session<N> {
    /// A session that has not begun. It asks for a connection at once.
    #[must_use]
    pub fn new(configuration: Configuration) -> Self {
        Self {
            deframer: Deframer::new(),
            received: Time::default(),
            request: [0; REQUEST],
            conversation: Conversation {
                configuration,
                state: State::Waiting,
                dialect: configuration.first_dialect,
                stage: 0,
                has_changed_dialect: false,
                questions: Vec::new(),
                clock: SensorClock::new(),
                until: Time::default(),
                pause: configuration.first_pause,
                lost: None,
                reports: Deque::new(),
                polled: None,
                asked_clock: None,
                speed: None,
                sent_speed: None,
            },
        }
    }

    /// How far the conversation is.
    #[must_use]
    pub const fn state(&self) -> State {
        self.conversation.state
    }

    /// The dialect that is spoken.
    #[must_use]
    pub const fn dialect(&self) -> Dialect {
        self.conversation.dialect
    }

    /// The sensor's clock.
    #[must_use]
    pub const fn clock(&self) -> &SensorClock {
        &self.conversation.clock
    }

    /// The connection is open.
    pub fn connected(&mut self, now: Time) {
        if self.conversation.state == State::Connecting {
            self.deframer.clear();
            self.conversation.begin();
            self.received = now;
        }
    }

    /// The connection could not be opened, or was closed by the other side.
    pub fn closed(&mut self) {
        let reason = match self.conversation.state {
            State::Waiting => return,
            State::Connecting => LostReason::NotConnected,
            _ => LostReason::Closed,
        };
        self.conversation.lose(reason);
    }

    /// Takes bytes that arrived at `now`; returns how many. Call [`poll`](Self::poll) before giving it the rest.
    pub fn receive(&mut self, bytes: &[u8], now: Time) -> usize {
        if matches!(self.conversation.state, State::Waiting | State::Connecting) {
            return bytes.len();
        }
        let count = self.deframer.extend(bytes);
        if count == 0 && !bytes.is_empty() {
            self.conversation.lose(LostReason::Overflow);
            return bytes.len();
        }
        self.received = now;
        count
    }

    /// Tells the sensor how fast it moves, as soon as this may be sent.
    pub const fn set_speed(&mut self, speed: SensorSpeed) {
        self.conversation.speed = Some(speed);
    }

    /// What to do next. `now` must not go backwards.
    pub fn poll<const BEAMS: usize, const REFLECTORS: usize>(
        &mut self,
        now: Time,
        revolution: &mut Revolution<BEAMS, REFLECTORS>,
    ) -> Step<'_> {
        let Self { deframer, received, request, conversation } = self;
        if let Some(report) = conversation.reports.pop_front() {
            return Step::Report(report);
        }
        if let Some(reason) = conversation.lost.take() {
            conversation.pause_after_loss(now);
            deframer.clear();
            return Step::Disconnect(reason);
        }
        // The deframer holds at most so many telegrams, because the shortest has five bytes.
        for _ in 0..=N / 5 {
            let Some(found) = deframer.next() else { break };
            match found {
                Deframed::Rubbish(count) => return Step::Report(Report::Rubbish(count)),
                Deframed::Telegram { dialect, payload, .. } => {
                    match conversation.take(dialect, payload, *received, revolution) {
                        Taken::Nothing => {}
                        Taken::Revolution => return Step::Revolution,
                        Taken::Report(report) => return Step::Report(report),
                    }
                    // What was lost on the way is told first.
                    if conversation.lost.is_some() {
                        break;
                    }
                }
            }
        }
        if let Some(report) = conversation.reports.pop_front() {
            return Step::Report(report);
        }
        conversation.check_deadlines(now);
        if let Some(report) = conversation.reports.pop_front() {
            return Step::Report(report);
        }
        if let Some(reason) = conversation.lost.take() {
            conversation.pause_after_loss(now);
            deframer.clear();
            return Step::Disconnect(reason);
        }
        conversation.act(now, request)
    }
}

/// What became of a telegram.
enum Taken {
    Nothing,
    Revolution,
    Report(Report),
}

impl Conversation {
    fn report(&mut self, report: Report) {
        // Reports that nobody fetches must not stop the conversation.
        let _ = self.reports.push_back(report);
    }

    fn enter(&mut self, state: State) {
        if self.state != state {
            self.state = state;
            self.report(Report::State(state));
        }
    }

    fn lose(&mut self, reason: LostReason) {
        self.lost.get_or_insert(reason);
    }

    fn pause_after_loss(&mut self, now: Time) {
        self.questions.clear();
        self.until = now.offset(self.pause);
        self.pause = libm::fmin(2.0 * self.pause, self.configuration.longest_pause);
        self.enter(State::Waiting);
    }

    fn begin(&mut self) {
        self.questions.clear();
        self.stage = 0;
        self.has_changed_dialect = false;
        self.polled = None;
        self.asked_clock = None;
        self.speed = None;
        self.sent_speed = None;
        self.enter(State::Identifying);
    }

    /// The telegrams of the start-up in their order, and the state in which each is sent.
    fn start_up(&self) -> Option<(State, Request<'static>)> {
        let configuration = &self.configuration;
        let write = |setting| (State::Configuring, Request::Write(setting));
        let call = |state, method| (state, Request::Call(method));
        Some(match self.stage {
            0 => (State::Identifying, Request::Read(Variable::DeviceIdent)),
            1 => call(
                State::LoggingIn,
                Method::SetAccessMode { level: configuration.user_level.number(), password: configuration.password },
            ),
            2 => call(State::Configuring, Method::ChangeState(OperatingMode::Standby)),
            3 => match configuration.layer {
                Some(layer) => write(Setting::CurrentLayer(layer)),
                None => (State::Configuring, Request::Read(Variable::CurrentLayer)),
            },
            4 => write(Setting::LandmarkDataFormat(configuration.landmark_format)),
            5 => write(Setting::ScanDataFormat(configuration.scan_format)),
            6 => write(Setting::PoseDataFormat(configuration.pose_format)),
            ENTER_MODE => call(State::EnteringMode, Method::ChangeState(configuration.mode)),
            stage if stage <= ENTER_MODE + usize::from(configuration.clock_exchanges) => {
                call(State::Synchronising, Method::GetTimestamp)
            }
            _ => return None,
        })
    }

    fn data_method(&self) -> Method<'static> {
        match self.configuration.mode {
            OperatingMode::LandmarkDetection => Method::GetLandmarkData { wait: true, dataset: 2 },
            _ => Method::GetData { wait: true, mask: self.configuration.mask },
        }
    }

    fn is_open(&self, method: MethodName) -> bool {
        self.questions.iter().any(|question| question.subject == Subject::Method(method))
    }

    fn check_deadlines(&mut self, now: Time) {
        if self.state == State::Connecting && now >= self.until {
            self.lose(LostReason::NotConnected);
        }
        let Some(index) = self.questions.iter().position(|question| now >= question.deadline) else { return };
        let question = self.questions.remove(index);
        match question.subject {
            Subject::Identity if !self.has_changed_dialect => {
                self.has_changed_dialect = true;
                self.dialect = self.dialect.other();
            }
            Subject::Method(MethodName::SetSpeed) => self.report(Report::CallUnanswered(MethodName::SetSpeed)),
            // A late answer about the time would be taken for that to the next question. A new connection has none.
            _ => self.lose(LostReason::NoAnswer(self.state)),
        }
    }

    fn act<'a>(&mut self, now: Time, request: &'a mut [u8; REQUEST]) -> Step<'a> {
        match self.state {
            State::Waiting if now >= self.until => {
                self.state = State::Connecting;
                self.until = now.offset(self.configuration.connect_timeout);
                Step::Connect
            }
            State::Waiting | State::Connecting => Step::Wait(self.until),
            _ => match self.next_request(now) {
                Some(next) => self.send(&next, now, request),
                None => Step::Wait(self.wakes()),
            },
        }
    }

    /// The request that is due, if any.
    fn next_request(&mut self, now: Time) -> Option<Request<'static>> {
        if let Some((_, next)) = self.start_up() {
            return self.questions.is_empty().then_some(next);
        }
        if let Some(speed) = self.speed
            && !self.is_open(MethodName::SetSpeed)
            && is_due(self.sent_speed, self.configuration.speed_spacing, now)
            && let Some(report) = speed.report(&self.clock, &self.configuration.frame)
        {
            self.speed = None;
            self.sent_speed = Some(now);
            return Some(Request::Call(Method::SetSpeed(report)));
        }
        // While data are on the way an answer about the time may have to wait for them.
        let data = self.data_method();
        if self.is_open(data.name()) || self.is_open(MethodName::GetTimestamp) {
            return None;
        }
        if is_due(self.asked_clock, self.configuration.clock_interval, now) {
            return Some(Request::Call(Method::GetTimestamp));
        }
        is_due(self.polled, self.configuration.poll_spacing, now).then(|| {
            self.polled = Some(now);
            Request::Call(data)
        })
    }

    fn send<'a>(&mut self, next: &Request, now: Time, request: &'a mut [u8; REQUEST]) -> Step<'a> {
        let subject = match next {
            Request::Write(setting) => Subject::Setting(setting.variable()),
            Request::Call(method) => Subject::Method(method.name()),
            Request::Read(Variable::DeviceIdent) | Request::ReadOther(_) => Subject::Identity,
            Request::Read(variable) => Subject::Setting(*variable),
        };
        let patience = match subject {
            Subject::Method(MethodName::ChangeState) => self.configuration.mode_timeout,
            _ => self.configuration.answer_timeout,
        };
        if subject == Subject::Method(MethodName::GetTimestamp) {
            self.asked_clock = Some(now);
        }
        let question = Question { subject, sent: now, deadline: now.offset(patience), is_accepted: false };
        // Every request of a session is short, and never more are open than there is room for.
        let _ = self.questions.push(question);
        match next.encode(self.dialect, request) {
            Ok(length) => Step::Send(request.get(..length).unwrap_or_default()),
            Err(_) => Step::Wait(question.deadline),
        }
    }

    /// When something is due, if no bytes arrive before.
    fn wakes(&self) -> Time {
        let deadlines = self.questions.iter().map(|question| question.deadline);
        let earliest = deadlines.min().unwrap_or(Time::from_micros(u64::MAX));
        if self.state != State::Running {
            return earliest;
        }
        let mut wakes = earliest;
        if !self.is_open(self.data_method().name())
            && !self.is_open(MethodName::GetTimestamp)
            && let Some(polled) = self.polled
        {
            wakes = wakes.min(polled.offset(self.configuration.poll_spacing));
        }
        if self.speed.is_some()
            && !self.is_open(MethodName::SetSpeed)
            && let Some(sent) = self.sent_speed
        {
            wakes = wakes.min(sent.offset(self.configuration.speed_spacing));
        }
        wakes
    }

    /// Takes the question that an answer is about out of the list.
    fn answered(&mut self, subject: Subject) -> Option<Question> {
        let index = self.questions.iter().position(|question| question.subject == subject)?;
        Some(self.questions.remove(index))
    }

    fn take<const BEAMS: usize, const REFLECTORS: usize>(
        &mut self,
        dialect: Dialect,
        payload: &[u8],
        received: Time,
        revolution: &mut Revolution<BEAMS, REFLECTORS>,
    ) -> Taken {
        let answer = match Answer::decode(dialect, payload) {
            Ok(answer) => answer,
            Err(error) => return Taken::Report(Report::Undecodable(error)),
        };
        if self.stage == 0 && !self.questions.is_empty() {
            // Any answer tells the dialect.
            self.dialect = dialect;
        }
        match answer {
            Answer::Value(value) => {
                let subject = match value {
                    Value::Setting(setting) => Subject::Setting(setting.variable()),
                    Value::DeviceIdent(..) => Subject::Identity,
                    Value::Other(name, _) if name == Variable::DeviceIdent.name() => Subject::Identity,
                    _ => return Taken::Report(Report::Unexpected),
                };
                self.take_start_up(subject)
            }
            Answer::Written(variable) => self.take_start_up(Subject::Setting(variable)),
            Answer::Accepted(method) => {
                let subject = Subject::Method(method);
                match self.questions.iter_mut().find(|question| question.subject == subject) {
                    Some(question) => question.is_accepted = true,
                    None => return Taken::Report(Report::Unexpected),
                }
                Taken::Nothing
            }
            Answer::Fault(fault) => self.take_fault(fault),
            Answer::Result(result) => {
                let Some(question) = self.answered(Subject::Method(result.method())) else {
                    return Taken::Report(Report::Unexpected);
                };
                self.take_result(&result, question, received, revolution)
            }
        }
    }

    /// An answer that says no more than that the question is answered.
    fn take_start_up(&mut self, subject: Subject) -> Taken {
        if self.answered(subject).is_none() {
            return Taken::Report(Report::Unexpected);
        }
        if subject == Subject::Identity {
            self.report(Report::Dialect(self.dialect));
        }
        self.advance();
        Taken::Nothing
    }

    fn advance(&mut self) {
        self.stage += 1;
        let state = self.start_up().map_or(State::Running, |(state, _)| state);
        self.enter(state);
    }

    /// A refusal names nothing: it is of the oldest question that was not accepted.
    fn take_fault(&mut self, fault: Fault) -> Taken {
        let Some(index) = self.questions.iter().position(|question| !question.is_accepted) else {
            return Taken::Report(Report::Unexpected);
        };
        let question = self.questions.remove(index);
        match question.subject {
            // A sensor that does not tell its name has told its dialect.
            Subject::Identity => {
                self.report(Report::Dialect(self.dialect));
                self.advance();
            }
            Subject::Setting(variable) => {
                self.report(Report::SettingRefused(variable, fault));
                self.advance();
            }
            Subject::Method(MethodName::SetSpeed) => {
                self.report(Report::CallRefused(MethodName::SetSpeed, fault));
            }
            Subject::Method(_) => self.lose(LostReason::Refused(self.state, fault)),
        }
        Taken::Nothing
    }

    fn take_result<const BEAMS: usize, const REFLECTORS: usize>(
        &mut self,
        result: &MethodResult,
        question: Question,
        received: Time,
        revolution: &mut Revolution<BEAMS, REFLECTORS>,
    ) -> Taken {
        match result {
            MethodResult::AccessMode(true) => self.advance(),
            MethodResult::AccessMode(false) => self.lose(LostReason::AccessDenied),
            MethodResult::State(ErrorCode::OK, _) => self.advance(),
            MethodResult::State(error, _) => self.lose(LostReason::Failed(MethodName::ChangeState, *error)),
            MethodResult::Timestamp(ErrorCode::OK, time) => {
                if let Err(error) = self.clock.record(question.sent, received, *time) {
                    self.report(Report::Clock(error));
                }
                if self.start_up().is_some() {
                    self.advance();
                }
            }
            MethodResult::Timestamp(error, _) => {
                self.lose(LostReason::Failed(MethodName::GetTimestamp, *error));
            }
            MethodResult::Data(data) => {
                let taken = self
                    .is_usable(MethodName::GetData, data.error)
                    .then(|| revolution.take(data, &self.clock, &self.configuration.frame));
                return self.taken(taken);
            }
            MethodResult::LandmarkData(data) => {
                let taken = self
                    .is_usable(MethodName::GetLandmarkData, data.error)
                    .then(|| revolution.take_landmarks(data, &self.clock, &self.configuration.frame));
                return self.taken(taken);
            }
            MethodResult::Plain(method, Some(error)) if *error != ErrorCode::OK => {
                self.report(Report::MethodFailed(*method, *error));
            }
            _ => {}
        }
        Taken::Nothing
    }

    /// Whether an answer with that error has data. A sensor in another mode is brought back.
    fn is_usable(&mut self, method: MethodName, error: ErrorCode) -> bool {
        match error {
            ErrorCode::OK | ErrorCode::NO_POSITION => return true,
            ErrorCode::WRONG_MODE => {
                self.stage = ENTER_MODE;
                self.enter(State::EnteringMode);
            }
            _ => {}
        }
        self.report(Report::MethodFailed(method, error));
        false
    }

    fn taken(&mut self, taken: Option<Result<(), RevolutionError>>) -> Taken {
        match taken {
            None => Taken::Nothing,
            Some(Err(error)) => Taken::Report(Report::Revolution(error)),
            Some(Ok(())) => {
                self.pause = self.configuration.first_pause;
                Taken::Revolution
            }
        }
    }
}

/// Place of the last change of mode among the telegrams of the start-up.
const ENTER_MODE: usize = 7;

fn is_due(last: Option<Time>, spacing: f64, now: Time) -> bool {
    last.is_none_or(|last| now >= last.offset(spacing))
}
