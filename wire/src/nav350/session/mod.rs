//! The conversation with one sensor, without sockets and without a clock.

mod answers;
mod configuration;
mod conversation;
mod report;

pub use configuration::Configuration;
pub use report::{LostReason, Report, State};

use agv_core::measurement::Time;

use super::{Revolution, SensorClock, SensorSpeed};
use crate::cola::{BUFFER, Deframed, Deframer, Dialect};
use answers::Taken;
use conversation::{Conversation, REQUEST};

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

/// The conversation with one sensor: bytes and times in, bytes, revolutions and reports out. `N` is the room for
/// received bytes.
///
/// The caller does what [`poll`](Self::poll) says until it says [`Step::Wait`], then waits for that time or for bytes,
/// whatever comes first.
#[derive(Clone, Debug)]
pub struct Session<const N: usize = BUFFER> {
    deframer: Deframer<N>,
    received: Time,
    /// Bytes since the last telegram that answered something.
    unanswering: usize,
    request: [u8; REQUEST],
    conversation: Conversation,
}

/// So many bytes without an answer, and the other side is no sensor, or out of its mind. The longest answer has 35 kB.
const LONGEST_BABBLE: usize = 1 << 20;

impl<const N: usize> Session<N> {
    /// A session that has not begun. It asks for a connection at once.
    #[must_use]
    pub fn new(configuration: Configuration) -> Self {
        Self {
            deframer: Deframer::new(),
            received: Time::default(),
            unanswering: 0,
            request: [0; REQUEST],
            conversation: Conversation::new(configuration),
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
            self.unanswering = 0;
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
        self.unanswering = self.unanswering.saturating_add(count);
        if self.unanswering > LONGEST_BABBLE {
            self.conversation.lose(LostReason::Babble);
        }
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
        let Self { deframer, received, unanswering, request, conversation } = self;
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
                    let taken = conversation.take(dialect, payload, *received, revolution);
                    if !matches!(taken, Taken::Report(Report::Undecodable(_) | Report::Unexpected)) {
                        *unanswering = 0;
                    }
                    match taken {
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
