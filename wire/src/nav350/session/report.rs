//! What a session tells people.

use core::fmt;

use crate::cola::{Dialect, Fault, ReadError};
use crate::nav350::{ClockError, ErrorCode, MethodName, RevolutionError, Variable};

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
    /// A mebibyte came, and no answer in it.
    Babble,
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
            Self::Babble => write!(formatter, "1 MiB came without an answer in it"),
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
