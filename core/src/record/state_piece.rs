//! What a log that begins in the middle of a drive knows of what was before, in pieces.

use serde::{Deserialize, Serialize};

/// Greatest number of bytes of a state in one record; more are written in pieces.
pub const STATE_A_RECORD: usize = 16 * 1024;

/// Whose state it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum StateOwner {
    /// The localiser, after all that was before the log: [`crate::localizer::Localizer::save_state`].
    Localizer,
    /// Whoever publishes, after all events before the log, the last of which the localiser had not answered yet for it:
    /// [`crate::localizer::OutputPredictor::save_state`].
    Predictor,
}

/// A piece of a state, of at most [`STATE_A_RECORD`] bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StatePiece<'a> {
    /// Whose state it is.
    pub owner: StateOwner,
    /// Length of the whole state, bytes.
    pub length: u32,
    /// Where the piece begins in it, bytes.
    pub start: u32,
    /// The bytes.
    pub bytes: &'a [u8],
}

impl<'a> StatePiece<'a> {
    /// The pieces of a state. None of one that is too long to be counted.
    pub fn of(owner: StateOwner, state: &'a [u8]) -> impl Iterator<Item = Self> {
        let length = u32::try_from(state.len()).ok();
        let pieces = length.map(|length| (length, state.chunks(STATE_A_RECORD)));
        pieces.into_iter().flat_map(move |(length, chunks)| {
            let starts = (0_u32..).step_by(STATE_A_RECORD);
            starts.zip(chunks).map(move |(start, bytes)| Self { owner, length, start, bytes })
        })
    }
}
