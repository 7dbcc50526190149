//! The log on its way from the localiser to whoever listens, in frames that are made once and used again and again.

use std::time::Duration;

use agv_controller::Estimate;
use agv_core::integrity::AlertLimits;
use agv_core::localizer::{Localize, Parameters};
use agv_core::measurement::Time;
use agv_core::record::{Record, encode};

use super::exchange::Exchange;
use super::incident::{Incident, IncidentWatch};
use super::state_keeper::{StateKeeper, States};
use crate::sync::queue::{Receiver, Sender, queue};

/// Frames that wait: half a second of the records of encoders and gyro at 100 Hz each, poses at 100 Hz, and a laser.
const FRAMES: usize = 256;
/// Longest frame, bytes: a scan of 1440 beams with intensities has fewer.
const LONGEST: usize = 16 * 1024;
/// What else waits.
const OTHERS: usize = 16;

/// A record as bytes.
pub(super) struct LogFrame {
    bytes: Box<[u8]>,
    length: usize,
}

impl LogFrame {
    /// What is to be told.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes[..self.length]
    }
}

/// What is told, in its order.
pub(super) enum LogItem {
    /// A record.
    Frame(LogFrame),
    /// A log may begin here, with the record of that number.
    States(Box<States>, u32),
    /// Something worth a log of its own has happened.
    Incident(Incident),
}

/// What makes logs begin in the middle of a drive, and sees what is worth one.
struct Parts {
    keeper: StateKeeper,
    watch: IncidentWatch,
    /// Time between two beginnings.
    every: Duration,
    begun: Time,
}

/// The writing end, which the localiser's loop has.
pub(super) struct LogWriter<'a> {
    sequence: u32,
    free: Receiver<LogFrame>,
    full: Sender<LogItem>,
    exchange: &'a Exchange,
    parts: Option<Parts>,
}

/// The other end.
pub(super) struct LogReader {
    free: Sender<LogFrame>,
    free_states: Option<Sender<Box<States>>>,
    pub full: Receiver<LogItem>,
}

/// A queue, whose frames are numbered behind those that a log begins with.
pub(super) fn log_queue(exchange: &Exchange, first: u32) -> (LogWriter<'_>, LogReader) {
    let (free_end, free) = queue(FRAMES);
    let (full, full_end) = queue(FRAMES + OTHERS);
    for _ in 0..FRAMES {
        // There is room for all.
        let _ = free_end.send(LogFrame { bytes: vec![0; LONGEST].into(), length: 0 });
    }
    let writer = LogWriter { sequence: first, free, full, exchange, parts: None };
    (writer, LogReader { free: free_end, free_states: None, full: full_end })
}

/// Lets logs begin again and again, of a vehicle with a localiser of so many bytes.
pub(super) fn divide(
    (writer, reader): (&mut LogWriter, &mut LogReader),
    parameters: &Parameters,
    limits: AlertLimits,
    (every, size): (Duration, usize),
) {
    let (keeper, free_states) = StateKeeper::new(parameters, size);
    let begun = writer.exchange.now();
    writer.parts = Some(Parts { keeper, watch: IncidentWatch::new(limits), every, begun });
    reader.free_states = Some(free_states);
}

impl LogWriter<'_> {
    /// Queues a record, or leaves it out.
    pub fn write(&mut self, record: &Record) {
        let sequence = self.sequence;
        self.sequence = sequence.wrapping_add(1);
        let incident = self.parts.as_mut().and_then(|parts| {
            parts.keeper.take(record);
            if let Record::Published(published) = record { parts.watch.see(&published.pose) } else { None }
        });
        let Some(mut frame) = self.free.receive() else { return self.exchange.lose_record() };
        frame.length = encode(record, sequence, &mut frame.bytes).unwrap_or_else(|_| {
            self.exchange.lose_record();
            0
        });
        // There are no more of them than there is room for.
        let _ = self.full.send(LogItem::Frame(frame));
        if let Some(incident) = incident {
            self.tell(incident);
        }
    }

    /// Queues an incident.
    pub fn tell(&mut self, incident: Incident) {
        if self.parts.is_some() {
            let _ = self.full.send(LogItem::Incident(incident));
        }
    }

    /// Takes what the bus will be told of the events so far.
    pub fn answer(&mut self, estimate: &Estimate) {
        if let Some(parts) = &mut self.parts {
            parts.keeper.answer(estimate);
        }
    }

    /// Lets a log begin behind the last event, if it is time for one and it can.
    pub fn begin_again(&mut self, localizer: &impl Localize) {
        let Some(parts) = &mut self.parts else { return };
        let now = self.exchange.now();
        if now.since(parts.begun) < parts.every.as_secs_f64() {
            return;
        }
        if let Some(states) = parts.keeper.states(localizer) {
            parts.begun = now;
            let _ = self.full.send(LogItem::States(states, self.sequence));
        }
    }
}

impl LogReader {
    /// Gives back what is used again.
    pub fn give_back(&self, item: LogItem) {
        match item {
            LogItem::Frame(frame) => {
                let _ = self.free.send(frame);
            }
            LogItem::States(states, _) => {
                let _ = self.free_states.as_ref().map(|free| free.send(states));
            }
            LogItem::Incident(_) => {}
        }
    }
}
