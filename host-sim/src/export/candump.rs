//! The frames of a log as candump writes them.

use std::io::{self, Write};
use std::path::Path;

use agv_wire::can::frame::AnyFrame;

use crate::import::candump::{SeenFrame, log_line};
use crate::import::raw;
use crate::log::LogError;

/// Why frames could not be written.
#[derive(Debug, thiserror::Error)]
pub enum CandumpError {
    /// The log cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The operating system refused.
    #[error("the frames cannot be written: {0}")]
    Io(#[from] io::Error),
}

/// Writes the frames of both directions that a log holds, as `candump -l` does, and returns how many there are. The times
/// are those of the log.
///
/// # Errors
/// See [`CandumpError`].
pub fn write(log: &Path, interface: &str, output: &mut impl Write) -> Result<usize, CandumpError> {
    let mut count = 0;
    for raw in raw::read(log)? {
        let Some(frame): Option<AnyFrame> = raw.can_frame() else { continue };
        let seen = SeenFrame { time: Some(raw.time), interface: interface.to_owned(), frame };
        writeln!(output, "{}", log_line(&seen))?;
        count += 1;
    }
    output.flush()?;
    Ok(count)
}
