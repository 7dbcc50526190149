//! A log with an answer to every event: the recorded ones where there are any, else those of a replay.

use std::path::Path;

use crate::log::{self, Contents, LogError};
use crate::recording::Recording;
use crate::replay::{Replay, ReplayError, replay};

/// Why a log has no answers.
#[derive(Debug, thiserror::Error)]
pub enum AnsweredError {
    /// The log cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// It cannot be replayed.
    #[error(transparent)]
    Replay(#[from] ReplayError),
}

/// Reads a log and gives it an answer to every event. Recorded answers are taken where there is one to every event;
/// `progress` is called with the number of events replayed and that of all.
///
/// # Errors
/// If the log cannot be read, or its map cannot be used.
pub fn read(path: &Path, mut progress: impl FnMut(usize, usize)) -> Result<(Recording, Replay), AnsweredError> {
    let Contents { recording, outputs, .. } = log::read_contents(path, |_| ())?;
    if !outputs.is_empty() && outputs.len() == recording.events.len() {
        let mut answers = Replay::default();
        for output in outputs {
            answers.poses.push(output.pose);
            answers.uses.extend(output.uses);
            answers.use_ends.push(answers.uses.len());
        }
        return Ok((recording, answers));
    }
    let events = recording.events.len();
    let answers = replay(&recording, |done| progress(done, events))?;
    Ok((recording, answers))
}
