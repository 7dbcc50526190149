//! What becomes of an answer.

use agv_core::measurement::Time;

use super::conversation::{Conversation, ENTER_MODE, Question, Subject};
use super::report::{LostReason, Report, State};
use crate::cola::{Dialect, Fault};
use crate::nav350::{
    Answer, ErrorCode, MethodName, MethodResult, Orientation, Revolution, RevolutionError, Setting, Value, Variable,
};

/// What became of a telegram.
pub(super) enum Taken {
    Nothing,
    Revolution,
    Report(Report),
}

impl Conversation {
    /// Takes the question that an answer is about out of the list.
    pub(super) fn answered(&mut self, subject: Subject) -> Option<Question> {
        let index = self.questions.iter().position(|question| question.subject == subject)?;
        Some(self.questions.remove(index))
    }

    pub(super) fn take<const BEAMS: usize, const REFLECTORS: usize>(
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
                    Value::Setting(setting) => {
                        self.compare(&setting);
                        Subject::Setting(setting.variable())
                    }
                    Value::DeviceIdent(..) => Subject::Identity,
                    Value::Other(name, _) if name == Variable::DeviceIdent.name() => Subject::Identity,
                    _ => return Taken::Report(Report::Unexpected),
                };
                self.take_start_up(subject)
            }
            Answer::Written(variable) => {
                if let Some(written) = self.configuration.wanted(variable) {
                    self.follow(&written);
                }
                self.take_start_up(Subject::Setting(variable))
            }
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
    pub(super) fn take_start_up(&mut self, subject: Subject) -> Taken {
        if self.answered(subject).is_none() {
            return Taken::Report(Report::Unexpected);
        }
        if subject == Subject::Identity {
            self.report(Report::Dialect(self.dialect));
        }
        self.advance();
        Taken::Nothing
    }

    /// Takes a setting as the sensor has it.
    fn compare(&mut self, found: &Setting) {
        self.follow(found);
        if self.configuration.wanted(found.variable()).is_some_and(|wanted| wanted != *found) {
            self.is_as_wanted = false;
        }
    }

    /// Angles grow as the sensor says.
    fn follow(&mut self, setting: &Setting) {
        if let Setting::CoordinateOrientation(number) = setting
            && let Some(orientation) = Orientation::of_number(*number)
        {
            self.configuration.frame.is_clockwise = orientation == Orientation::Clockwise;
        }
    }

    pub(super) fn advance(&mut self) {
        self.next_stage();
        let state = self.start_up().map_or(State::Running, |(state, _)| state);
        self.enter(state);
    }

    /// A refusal names nothing: it is of the oldest question that was not accepted.
    pub(super) fn take_fault(&mut self, fault: Fault) -> Taken {
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
                self.is_as_wanted &= self.configuration.wanted(variable).is_none();
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

    pub(super) fn take_result<const BEAMS: usize, const REFLECTORS: usize>(
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
    pub(super) fn is_usable(&mut self, method: MethodName, error: ErrorCode) -> bool {
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

    pub(super) fn taken(&mut self, taken: Option<Result<(), RevolutionError>>) -> Taken {
        match taken {
            None => Taken::Nothing,
            Some(Err(error)) => Taken::Report(Report::Revolution(error)),
            Some(Ok(())) => {
                self.pause = self.configuration.first_pause;
                self.may_stay = true;
                Taken::Revolution
            }
        }
    }
}
