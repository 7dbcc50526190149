//! What is asked, when, and how long an answer may take.

use agv_core::measurement::Time;
use heapless::{Deque, Vec};

use super::Step;
use super::configuration::Configuration;
use super::report::{LostReason, Report, State};
use crate::cola::Dialect;
use crate::nav350::{Method, MethodName, OperatingMode, Request, SensorClock, SensorSpeed, Variable};

/// What a question is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Subject {
    Identity,
    Setting(Variable),
    Method(MethodName),
}

/// A question without an answer yet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Question {
    pub(super) subject: Subject,
    pub(super) sent: Time,
    pub(super) deadline: Time,
    pub(super) is_accepted: bool,
}

/// Length of the longest request that a session sends, with room to spare.
pub(super) const REQUEST: usize = 128;
/// Questions that can be open at once: data, speed, time.
pub(super) const QUESTIONS: usize = 4;
/// Reports that wait to be fetched; later ones are dropped.
pub(super) const REPORTS: usize = 8;

#[derive(Clone, Debug)]
pub(super) struct Conversation {
    pub(super) configuration: Configuration,
    pub(super) state: State,
    pub(super) dialect: Dialect,
    /// Which telegram of the start-up is next.
    pub(super) stage: usize,
    /// Whether the sensor's settings, as far as they were read, are those that are wanted.
    pub(super) is_as_wanted: bool,
    /// Whether settings that are as wanted may stay: not if a start that left them brought no revolution.
    pub(super) may_stay: bool,
    pub(super) has_changed_dialect: bool,
    pub(super) questions: Vec<Question, QUESTIONS>,
    pub(super) clock: SensorClock,
    /// When the state [`State::Waiting`] or [`State::Connecting`] ends.
    pub(super) until: Time,
    pub(super) pause: f64,
    pub(super) lost: Option<LostReason>,
    pub(super) reports: Deque<Report, REPORTS>,
    pub(super) polled: Option<Time>,
    pub(super) asked_clock: Option<Time>,
    pub(super) speed: Option<SensorSpeed>,
    pub(super) sent_speed: Option<Time>,
}

impl Conversation {
    /// A conversation that has not begun.
    pub(super) fn new(configuration: Configuration) -> Self {
        Self {
            configuration,
            state: State::Waiting,
            dialect: configuration.first_dialect,
            stage: 0,
            is_as_wanted: true,
            may_stay: true,
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
        }
    }

    pub(super) fn report(&mut self, report: Report) {
        // Reports that nobody fetches must not stop the conversation.
        let _ = self.reports.push_back(report);
    }

    pub(super) fn enter(&mut self, state: State) {
        if self.state != state {
            self.state = state;
            self.report(Report::State(state));
        }
    }

    pub(super) fn lose(&mut self, reason: LostReason) {
        self.lost.get_or_insert(reason);
    }

    pub(super) fn pause_after_loss(&mut self, now: Time) {
        self.questions.clear();
        self.until = now.offset(self.pause);
        self.pause = libm::fmin(2.0 * self.pause, self.configuration.longest_pause);
        self.enter(State::Waiting);
    }

    pub(super) fn begin(&mut self) {
        self.questions.clear();
        self.stage = 0;
        self.is_as_wanted = self.may_stay;
        self.may_stay = false;
        self.has_changed_dialect = false;
        self.polled = None;
        self.asked_clock = None;
        self.speed = None;
        self.sent_speed = None;
        self.enter(State::Identifying);
    }

    /// The telegrams of the start-up in their order, and the state in which each is sent. A sensor whose settings are as wanted, as
    /// behind a cut line, keeps its mode.
    pub(super) fn start_up(&self) -> Option<(State, Request<'static>)> {
        let configuration = &self.configuration;
        let call = |state, method| (state, Request::Call(method));
        Some(match self.stage {
            0 => (State::Identifying, Request::Read(Variable::DeviceIdent)),
            1 => call(
                State::LoggingIn,
                Method::SetAccessMode { level: configuration.user_level.number(), password: configuration.password },
            ),
            STANDBY => call(State::Configuring, Method::ChangeState(OperatingMode::Standby)),
            stage if stage < ENTER_MODE => (State::Configuring, of_setting(stage, configuration)?),
            ENTER_MODE => call(State::EnteringMode, Method::ChangeState(configuration.mode)),
            stage if stage <= ENTER_MODE + usize::from(configuration.clock_exchanges) => {
                call(State::Synchronising, Method::GetTimestamp)
            }
            _ => return None,
        })
    }

    /// The next stage that has something to ask or to say.
    pub(super) fn next_stage(&mut self) {
        self.stage += 1;
        if self.stage == STANDBY && self.is_as_wanted {
            self.stage = ENTER_MODE + 1;
        }
        let configuration = &self.configuration;
        while (STANDBY + 1..ENTER_MODE).contains(&self.stage) && of_setting(self.stage, configuration).is_none() {
            self.stage += 1;
        }
    }

    pub(super) fn data_method(&self) -> Method<'static> {
        match self.configuration.mode {
            OperatingMode::LandmarkDetection => Method::GetLandmarkData { wait: true, dataset: 2 },
            _ => Method::GetData { wait: true, mask: self.configuration.mask },
        }
    }

    pub(super) fn is_open(&self, method: MethodName) -> bool {
        self.questions.iter().any(|question| question.subject == Subject::Method(method))
    }

    pub(super) fn check_deadlines(&mut self, now: Time) {
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
            // What it does not tell is written.
            Subject::Setting(_) if self.stage < STANDBY => {
                self.is_as_wanted = false;
                self.advance();
            }
            // A late answer about the time would be taken for that to the next question. A new connection has none.
            _ => self.lose(LostReason::NoAnswer(self.state)),
        }
    }

    pub(super) fn act<'a>(&mut self, now: Time, request: &'a mut [u8; REQUEST]) -> Step<'a> {
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
    pub(super) fn next_request(&mut self, now: Time) -> Option<Request<'static>> {
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

    pub(super) fn send<'a>(&mut self, next: &Request, now: Time, request: &'a mut [u8; REQUEST]) -> Step<'a> {
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
    pub(super) fn wakes(&self) -> Time {
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
}

/// What is read and, if it is not as wanted, written, in this order.
const COMPARED: [Variable; 5] = [
    Variable::CurrentLayer,
    Variable::LandmarkDataFormat,
    Variable::ScanDataFormat,
    Variable::PoseDataFormat,
    Variable::CoordinateOrientation,
];

/// Place of the first variable that is read among the telegrams of the start-up.
const READ: usize = 2;
/// Of the change to the mode in which settings can be written.
pub(super) const STANDBY: usize = READ + COMPARED.len();
/// Of the last change of mode.
pub(super) const ENTER_MODE: usize = STANDBY + 1 + COMPARED.len();

/// What is asked or said of a setting at that stage; None if there is nothing.
fn of_setting(stage: usize, configuration: &Configuration) -> Option<Request<'static>> {
    match stage.checked_sub(STANDBY + 1) {
        Some(written) => configuration.wanted(*COMPARED.get(written)?).map(Request::Write),
        None => COMPARED.get(stage.checked_sub(READ)?).copied().map(Request::Read),
    }
}

fn is_due(last: Option<Time>, spacing: f64, now: Time) -> bool {
    last.is_none_or(|last| now >= last.offset(spacing))
}
