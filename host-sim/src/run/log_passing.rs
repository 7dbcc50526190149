//! The log on its way to whoever listens, and to the disk.

use std::time::Instant;

use agv_core::measurement::Time;

use super::LOOK;
use super::exchange::Exchange;
use super::log_file::LogFile;
use super::log_queue::{LogItem, LogReader};
use super::log_ring::LogRing;
use crate::live::relay::Relay;
use crate::log::LogError;
use crate::sync::queue::Closed;

/// The log on the disk: the file of the whole run, and the ring, where they are wanted.
pub(super) struct LogDisk<'a> {
    file: Option<LogFile>,
    ring: Option<LogRing<'a>>,
    /// A disk that is full says so each time; people are told once, until it has taken something again.
    is_told: bool,
    note: &'a (dyn Fn(&str) + Sync),
}

impl<'a> LogDisk<'a> {
    /// Begins the ring. `note` is told what is wrong.
    pub fn begin(file: Option<LogFile>, ring: Option<LogRing<'a>>, note: &'a (dyn Fn(&str) + Sync)) -> Self {
        let mut disk = Self { file, ring, is_told: false, note };
        let begun = disk.ring.as_mut().map(LogRing::begin);
        disk.tell(begun);
        disk
    }

    fn tell(&mut self, outcome: Option<Result<(), LogError>>) {
        match outcome {
            None => {}
            Some(Ok(())) => self.is_told = false,
            Some(Err(error)) if !std::mem::replace(&mut self.is_told, true) => {
                (self.note)(&format!("recording: {error}"));
            }
            Some(Err(_)) => {}
        }
    }

    fn finish_file(&mut self, error: Option<LogError>) {
        let file = self.file.take();
        let outcome = error.map_or_else(|| file.map_or(Ok(()), LogFile::finish), Err);
        if let Err(error) = outcome {
            (self.note)(&format!("log: {error}; no more is written to it"));
        }
    }

    /// Takes what is told at `now`.
    pub fn take(&mut self, item: &LogItem, now: Time) {
        let outcome = match item {
            LogItem::Frame(frame) => {
                if let Some(Err(error)) = self.file.as_mut().map(|file| file.write(frame.bytes())) {
                    self.finish_file(Some(error));
                }
                // A frame alone says nothing of a disk that was full.
                self.ring.as_mut().map(|ring| ring.write(frame.bytes(), now)).filter(Result::is_err)
            }
            LogItem::States(states, next) => self.ring.as_mut().map(|ring| ring.go_on(states, *next, now)),
            LogItem::Incident(incident) => {
                if let Some(ring) = &mut self.ring {
                    ring.take(*incident, now);
                }
                None
            }
        };
        self.tell(outcome);
    }

    /// Does what is due at `now`.
    pub fn look(&mut self, now: Time) {
        let kept = self.ring.as_mut().filter(|ring| ring.is_due(now)).map(LogRing::keep);
        self.tell(kept);
    }

    /// Ends with the run.
    pub fn finish(mut self, now: Time) {
        let finished = self.ring.take().map(|ring| ring.finish(now));
        self.tell(finished);
        self.finish_file(None);
    }
}

/// Passes the log on to those who listen, and to the disk, until everything ends and nothing is left.
pub(super) fn pass_log(log: &LogReader, relay: &Relay, mut disk: LogDisk, exchange: &Exchange) {
    loop {
        match log.full.wait(Instant::now() + LOOK) {
            Ok(Some(item)) => {
                if let LogItem::Frame(frame) = &item {
                    relay.pass_frame(frame.bytes());
                }
                disk.take(&item, exchange.now());
                log.give_back(item);
            }
            Ok(None) if !exchange.is_over() => {}
            Ok(None) | Err(Closed) => return disk.finish(exchange.now()),
        }
        disk.look(exchange.now());
    }
}
