//! Where a timeline comes from.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use agv_core::localizer::Localizer;
use agv_core::maps::MapError;
use agv_core::record::{Item, Record};

use super::server::Shared;
use super::timeline::Asked;
use crate::live::stream::{Connection, LogCopy};
use crate::log::{LogError, Reader};
use crate::replay::ReplayError;

/// Why there is nothing, or nothing more, to look at.
#[derive(Debug, thiserror::Error)]
pub enum FeedError {
    /// The log cannot be read, or written.
    #[error(transparent)]
    Log(#[from] LogError),
    /// It cannot be replayed.
    #[error(transparent)]
    Replay(#[from] ReplayError),
}

/// Records that are taken at once, before somebody else may look.
const BATCH: usize = 512;

/// Reads a log. One without answers is replayed: its scans are there at once, its poses one after the other.
///
/// # Errors
/// If the log cannot be read, or its map cannot be used.
pub fn load(path: &Path, shared: &Shared, is_stopped: &AtomicBool) -> Result<(), FeedError> {
    let size = std::fs::metadata(path).map_or(0, |metadata| metadata.len()).max(1);
    let mut has_answers = false;
    let mut reader = Reader::open(path)?;
    let mut is_at_end = false;
    while !is_at_end && !is_stopped.load(Ordering::Relaxed) {
        let mut timeline = shared.write();
        for _ in 0..BATCH {
            match reader.next()? {
                Some(Item::Record { offset, record, .. }) => {
                    has_answers |= matches!(record, Record::Output(_));
                    timeline.take(&record, offset);
                }
                Some(Item::Damage(damage)) => timeline.take_damage(&damage),
                None => {
                    is_at_end = true;
                    break;
                }
            }
        }
        timeline.progress = reader.position() as f64 / size as f64;
    }
    if !has_answers {
        replay(path, size, shared, is_stopped)?;
    }
    let mut timeline = shared.write();
    timeline.progress = 1.0;
    timeline.is_complete = true;
    Ok(())
}

fn replay(path: &Path, size: u64, shared: &Shared, is_stopped: &AtomicBool) -> Result<(), FeedError> {
    let mut localizer: Box<Localizer> = {
        let timeline = shared.read();
        let mut localizer = Box::new(Localizer::new(timeline.parameters));
        localizer.add_landmarks(&timeline.landmarks).map_err(|error| match error {
            MapError::Full => ReplayError::MapTooLarge,
            MapError::NotFinite => ReplayError::MapNotFinite,
        })?;
        localizer
    };
    let mut reader = Reader::open(path)?;
    let mut answers = Vec::with_capacity(BATCH);
    let mut is_at_end = false;
    while !is_at_end && !is_stopped.load(Ordering::Relaxed) {
        // The localiser works while others may look.
        while answers.len() < BATCH && !is_at_end {
            match reader.next()? {
                Some(Item::Record { record: Record::Event(event), .. }) => {
                    let outputs = localizer.handle(&event);
                    answers.push((Asked::of(&event), outputs.pose, outputs.uses.to_vec()));
                }
                Some(_) => {}
                None => is_at_end = true,
            }
        }
        let mut timeline = shared.write();
        for (asked, pose, uses) in answers.drain(..) {
            timeline.take_replayed(asked, &pose, &uses);
        }
        timeline.progress = reader.position() as f64 / size as f64;
    }
    Ok(())
}

/// Pause before a controller that does not answer is asked again.
const PAUSE: Duration = Duration::from_millis(200);

/// Follows the log stream of a controller until it ends or `is_stopped`, and writes it to `output` if that is given.
/// Waits for a controller that does not answer yet, and calls `wait` with the reason, the first time and when it changes.
///
/// # Errors
/// If what comes is no log, or the log cannot be written.
pub fn follow(
    host: &str,
    output: Option<&Path>,
    shared: &Shared,
    is_stopped: &Arc<AtomicBool>,
    mut wait: impl FnMut(&str),
) -> Result<(), FeedError> {
    let mut told = String::new();
    let mut copy = output.map(LogCopy::new);
    let outcome = loop {
        let mut has_begun = false;
        let outcome = Connection::open(host, is_stopped).and_then(|connection| {
            connection.read(|item| {
                has_begun = true;
                match &item {
                    Item::Record { record, .. } => shared.write().take(record, 0),
                    Item::Damage(damage) => shared.write().take_damage(damage),
                }
                copy.as_mut().map_or(Ok(()), |copy| copy.take(&item))
            })
        });
        match outcome {
            Err(reason @ (LogError::Empty { .. } | LogError::Io { .. }))
                if !has_begun && !is_stopped.load(Ordering::Relaxed) =>
            {
                let reason = reason.to_string();
                if reason != told {
                    wait(&reason);
                    told = reason;
                }
                std::thread::sleep(PAUSE);
            }
            outcome => break outcome,
        }
    };
    shared.write().is_complete = true;
    let finished = copy.map_or(Ok(()), |copy| copy.finish().map(|_| ()));
    outcome.and(finished)?;
    Ok(())
}
