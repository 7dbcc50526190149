//! The log that a recording was made of.

use std::io::Write;

use crate::log;
use crate::recording::Recording;
use crate::ros::{ATTACHED_LOG, Bag};

/// Why there is no attached log that could be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NoAttachedLog {
    /// None is attached, or the file ends before the place where that would be said.
    Missing,
    /// It is damaged.
    Damaged,
}

/// The drive of the log that is attached to a recording.
pub(super) fn read(bag: &Bag) -> Result<Recording, NoAttachedLog> {
    let bytes = bag.attached(ATTACHED_LOG).ok_or(NoAttachedLog::Missing)?;
    drive(&bytes).ok_or(NoAttachedLog::Damaged)
}

fn drive(bytes: &[u8]) -> Option<Recording> {
    let mut aside = tempfile::NamedTempFile::new().ok()?;
    aside.write_all(bytes).ok()?;
    let (recording, damages) = log::read(aside.path()).ok()?;
    damages.is_empty().then_some(recording)
}
