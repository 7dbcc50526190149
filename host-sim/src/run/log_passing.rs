//! The log on its way to whoever listens, and to the disk.

use super::LOOK;
use super::exchange::Exchange;
use super::log_file::LogFile;
use super::log_queue::{LogItem, LogReader};
use super::log_ring::LogRing;
use crate::live::relay::Relay;
use crate::log::LogError;

/// Passes the log on to those who listen, and to its files, until everything ends and nothing is left.
pub(super) fn pass_log(
    log: &LogReader,
    relay: &Relay,
    (mut file, mut ring): (Option<LogFile>, Option<LogRing>),
    exchange: &Exchange,
    note: &(dyn Fn(&str) + Sync),
) {
    let finish = |file: Option<LogFile>, error: Option<LogError>| {
        let outcome = error.map_or_else(|| file.map_or(Ok(()), LogFile::finish), Err);
        if let Err(error) = outcome {
            note(&format!("log: {error}; no more is written to it"));
        }
    };
    // A disk that is full says so each time; people are told once, until it has taken something again.
    let mut is_told = false;
    let mut tell = |outcome: Result<(), LogError>| match outcome {
        Ok(()) => is_told = false,
        Err(error) if !std::mem::replace(&mut is_told, true) => note(&format!("recording: {error}")),
        Err(_) => {}
    };
    if let Some(ring) = &mut ring {
        tell(ring.begin());
    }
    loop {
        match log.full.recv_timeout(LOOK) {
            Ok(LogItem::Frame(frame)) => {
                relay.pass_frame(frame.bytes());
                if let Some(Err(error)) = file.as_mut().map(|file| file.write(frame.bytes())) {
                    finish(file.take(), Some(error));
                }
                if let Some(Err(error)) = ring.as_mut().map(|ring| ring.write(frame.bytes())) {
                    tell(Err(error));
                }
                log.give_back(frame);
            }
            Ok(LogItem::States(states, next)) => {
                if let Some(ring) = &mut ring {
                    tell(ring.go_on(&states, next));
                }
                log.give_states_back(states);
            }
            Ok(LogItem::Incident(incident)) => {
                if let Some(ring) = &mut ring {
                    ring.take(incident);
                }
            }
            Err(std::sync::mpsc::RecvTimeoutError::Timeout) if !exchange.is_over() => {}
            Err(_) => {
                if let Some(ring) = ring {
                    tell(ring.finish());
                }
                return finish(file, None);
            }
        }
        if let Some(ring) = ring.as_mut().filter(|ring| ring.is_due()) {
            tell(ring.keep());
        }
    }
}
