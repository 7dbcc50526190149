//! What a NAV350 said to another host, from the bytes of both directions.

use agv_core::measurement::Time;
use agv_wire::cola::{Deframed, Deframer};
use agv_wire::nav350::{
    Answer, Channel, DeviceTime, ErrorCode, Method, MethodResult, Request, Revolution, SensorClock, SensorFrame,
};

/// Room for the bytes of a telegram that is not complete.
const ROOM: usize = 1 << 16;

/// What was heard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heard {
    /// A revolution.
    Revolution,
    /// A revolution that came before the sensor's clock was known, or could not be used.
    UnusableRevolution,
    /// So many bytes belonged to no telegram.
    Rubbish(usize),
    /// A telegram from the sensor could not be read.
    Undecodable,
}

/// Listens to a talk with a sensor, and makes of it what [`Session`](agv_wire::nav350::Session) does: from the
/// same bytes at the same times the same revolutions. The sensor's clock is known from the questions for it that it
/// hears; of a host that never asks, the arrival of each scan is taken as the end of its revolution.
pub struct Listener {
    questions: Box<Deframer<ROOM>>,
    answers: Box<Deframer<ROOM>>,
    talk: Talk,
}

/// What is known of the sensor.
struct Talk {
    clock: SensorClock,
    /// The clock rests on arrivals.
    is_clock_assumed: bool,
    frame: SensorFrame,
    revolution: Box<Revolution>,
    /// When the sensor was asked for its time, if that is not answered.
    asked_time: Option<Time>,
}

impl Listener {
    /// A listener to a sensor with that frame.
    #[must_use]
    pub fn new(frame: SensorFrame) -> Self {
        let talk = Talk {
            clock: SensorClock::new(),
            is_clock_assumed: false,
            frame,
            revolution: Box::default(),
            asked_time: None,
        };
        Self { questions: Box::default(), answers: Box::default(), talk }
    }

    /// A new connection begins: what was not complete will not be.
    pub fn connect(&mut self) {
        self.questions.clear();
        self.answers.clear();
        self.talk.asked_time = None;
    }

    /// The host sent these bytes.
    pub fn sent(&mut self, time: Time, mut bytes: &[u8]) {
        while !bytes.is_empty() {
            let taken = self.questions.extend(bytes);
            bytes = bytes.get(taken..).unwrap_or_default();
            if taken == 0 {
                self.questions.clear();
            }
            while let Some(found) = self.questions.next() {
                let Deframed::Telegram { dialect, payload, .. } = found else { continue };
                if let Ok(Request::Call(Method::GetTimestamp)) = Request::decode(dialect, payload) {
                    self.talk.asked_time = Some(time);
                }
            }
        }
    }

    /// The sensor sent these bytes. `hear` is told what they complete.
    ///
    /// # Errors
    /// What `hear` returns.
    pub fn received<E>(
        &mut self,
        time: Time,
        mut bytes: &[u8],
        mut hear: impl FnMut(Heard, &Revolution) -> Result<(), E>,
    ) -> Result<(), E> {
        while !bytes.is_empty() {
            let taken = self.answers.extend(bytes);
            bytes = bytes.get(taken..).unwrap_or_default();
            if taken == 0 {
                hear(Heard::Rubbish(self.answers.waiting()), &self.talk.revolution)?;
                self.answers.clear();
            }
            while let Some(found) = self.answers.next() {
                let heard = match found {
                    Deframed::Rubbish(count) => Some(Heard::Rubbish(count)),
                    Deframed::Telegram { dialect, payload, .. } => match Answer::decode(dialect, payload) {
                        Ok(answer) => self.talk.take(&answer, time),
                        Err(_) => Some(Heard::Undecodable),
                    },
                };
                if let Some(heard) = heard {
                    hear(heard, &self.talk.revolution)?;
                }
            }
        }
        Ok(())
    }
}

impl Talk {
    fn take(&mut self, answer: &Answer, received: Time) -> Option<Heard> {
        let is_usable = |error| matches!(error, ErrorCode::OK | ErrorCode::NO_POSITION);
        let taken = match answer {
            Answer::Result(MethodResult::Timestamp(ErrorCode::OK, device)) => {
                if let Some(sent) = self.asked_time.take() {
                    if core::mem::take(&mut self.is_clock_assumed) {
                        self.clock = SensorClock::new();
                    }
                    // A late answer is left out, and a restarted clock taken anew, by the clock itself.
                    let _ = self.clock.record(sent, received, *device);
                }
                return None;
            }
            Answer::Result(MethodResult::Data(data)) if is_usable(data.error) => {
                self.assume_clock(received, &data.channels);
                self.revolution.take(data, &self.clock, &self.frame)
            }
            Answer::Result(MethodResult::LandmarkData(data)) if is_usable(data.error) => {
                self.assume_clock(received, &data.channels);
                self.revolution.take_landmarks(data, &self.clock, &self.frame)
            }
            _ => return None,
        };
        Some(if taken.is_ok() { Heard::Revolution } else { Heard::UnusableRevolution })
    }

    fn assume_clock(&mut self, received: Time, channels: &[Channel<u32>]) {
        let Some(channel) = channels.first().filter(|_| self.is_clock_assumed || !self.clock.is_known()) else {
            return;
        };
        self.is_clock_assumed = true;
        let period = (self.frame.period * 1e3).round() as u32;
        let _ = self.clock.record(received, received, DeviceTime(channel.start.0.wrapping_add(period)));
    }
}
