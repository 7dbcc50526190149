//! Logs of a CAN bus as others write them: candump, Vector's .asc and PEAK's .trc. A file that ends early is read up to there, what
//! is no frame is counted, and times that cannot be are told.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use agv_wire::can::frame::{AnyFrame, Id};

use super::can_times::settle;
use super::candump::{self, SeenFrame};
use super::peak_trc::{self, Columns};
use super::vector_asc;
use crate::account::Account;
use crate::text_file::{self, TextFileError};

/// Why a log of a CAN bus cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum CanLogError {
    /// It cannot be read as text.
    #[error(transparent)]
    Text(#[from] TextFileError),
    /// It is of no known kind.
    #[error(
        "{}:{line}: this is no log of a CAN bus: {seen:?}; expected lines of candump -l ({}), of Vector's .asc ({}) or of PEAK's .trc \
         ({})",
        path.display(), candump::EXPECTED, vector_asc::EXPECTED, peak_trc::EXPECTED
    )]
    Unknown {
        /// The file.
        path: PathBuf,
        /// The first line that is no frame.
        line: usize,
        /// What stands there.
        seen: String,
    },
    /// Columns of PEAK's file are not known.
    #[error("{}: columns of version {version:?} of .trc are not known; save it as version 1.1 or 2.1", path.display())]
    Version {
        /// The file.
        path: PathBuf,
        /// What it says.
        version: String,
    },
    /// No frame has a time.
    #[error("{}: none of its {frames} frames has a time: record with `candump -l`, or with `candump -ta`", path.display())]
    NoTimes {
        /// The file.
        path: PathBuf,
        /// How many frames there are.
        frames: usize,
    },
    /// There is no frame in it.
    #[error("{}: there is no frame in the log", path.display())]
    NoFrames {
        /// The file.
        path: PathBuf,
    },
}

/// A log of a CAN bus.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CanLog {
    /// Its frames in order of time; all of them have one.
    pub frames: Vec<SeenFrame>,
    /// What was left out and what is doubtful.
    pub account: Account,
}

/// A line of any of the formats.
enum Line {
    Frame(SeenFrame),
    Error,
    Xl,
    Dropped(usize),
    Other,
}

/// How the lines of a file are read.
enum Format {
    Candump,
    Vector(vector_asc::Dialect),
    Peak(Columns),
}

impl Format {
    fn of(path: &Path, text: &str) -> Result<Self, CanLogError> {
        if vector_asc::is_one(text) {
            return Ok(Self::Vector(vector_asc::Dialect::default()));
        }
        match peak_trc::columns(text) {
            Some(Ok(columns)) => Ok(Self::Peak(columns)),
            Some(Err(version)) => Err(CanLogError::Version { path: path.to_owned(), version }),
            None => Ok(Self::Candump),
        }
    }

    fn line(&mut self, text: &str) -> Option<Line> {
        match self {
            Self::Candump => candump::parse_line(text).map(|line| match line {
                candump::Line::Frame(frame) => Line::Frame(frame),
                candump::Line::Error => Line::Error,
                candump::Line::Xl => Line::Xl,
                candump::Line::Dropped(count) => Line::Dropped(count),
            }),
            Self::Vector(dialect) => {
                if dialect.take_header(text) {
                    return Some(Line::Other);
                }
                dialect.parse_line(text).map(|line| match line {
                    vector_asc::Line::Frame(frame) => Line::Frame(frame),
                    vector_asc::Line::Error => Line::Error,
                    vector_asc::Line::Other => Line::Other,
                })
            }
            Self::Peak(columns) => columns.parse_line(text).map(|line| match line {
                peak_trc::Line::Frame(frame) => Line::Frame(frame),
                peak_trc::Line::Error => Line::Error,
                peak_trc::Line::Other => Line::Other,
            }),
        }
    }
}

/// Whether a text begins as any of the formats does.
#[must_use]
pub fn is_one(text: &str) -> bool {
    let first = text.lines().find(|line| !line.trim().is_empty());
    vector_asc::is_one(text)
        || peak_trc::columns(text).is_some()
        || first.is_some_and(|line| candump::parse_line(line).is_some())
}

/// Reads a log.
///
/// # Errors
/// See [`CanLogError`].
pub fn read(path: &Path) -> Result<CanLog, CanLogError> {
    let text_file::ReadText { text, is_cut } = text_file::read_unpacked_as_far(path, "a log of a CAN bus")?;
    let mut log = of_text(path, &text)?;
    if is_cut {
        log.account.warn("the compressed file ends early: it was read up to there");
    }
    Ok(log)
}

/// What stands in a line, short enough for a message.
const SHOWN: usize = 60;

/// The log in a text; `path` is for complaints.
///
/// # Errors
/// See [`CanLogError`].
pub fn of_text(path: &Path, text: &str) -> Result<CanLog, CanLogError> {
    let mut format = Format::of(path, text)?;
    let lines: Vec<(usize, &str)> = (1..).zip(text.lines()).filter(|(_, text)| !text.trim().is_empty()).collect();
    let mut account = Account::default();
    let mut frames: Vec<(usize, SeenFrame)> = Vec::new();
    let mut unread: Vec<(usize, &str)> = Vec::new();
    let mut last_is_other = false;
    for (number, text) in &lines {
        let line = format.line(text);
        last_is_other =
            matches!(line, Some(Line::Other)) && text.trim_start().starts_with(|one: char| one.is_ascii_digit());
        match line {
            Some(Line::Frame(frame)) => frames.push((*number, frame)),
            Some(Line::Error) => account.set_aside("error frames, and what they mean", 1),
            Some(Line::Xl) => account.set_aside("frames of CAN XL, which no sensor here speaks", 1),
            Some(Line::Dropped(count)) => account.leave_out_some("frames that candump itself has lost", count),
            Some(Line::Other) => {}
            None => unread.push((*number, text)),
        }
    }
    let ends_early = !text.ends_with('\n');
    if ends_early
        && let (Some(last), Some(cut)) = (lines.last(), unread.last())
        && last == cut
    {
        unread.pop();
        account.warn(format!("the file ends in the middle of line {}: it was read up to there", last.0));
    } else if ends_early && is_cut(&frames) && lines.last().map(|line| line.0) == frames.last().map(|frame| frame.0) {
        frames.pop();
        let line = lines.last().map_or(0, |line| line.0);
        account.warn(format!("the file ends in the middle of line {line}: it was read up to there"));
    } else if ends_early && last_is_other {
        account.warn("the file ends in the middle of its last line: it was read up to there");
    }
    // A log with a few bad lines is still one.
    if let Some((line, seen)) = unread.first().filter(|_| unread.len() >= frames.len()) {
        return Err(CanLogError::Unknown {
            path: path.to_owned(),
            line: *line,
            seen: seen.chars().take(SHOWN).collect(),
        });
    }
    for (line, _) in unread {
        account.leave_out("lines that are no frame", format!("at line {line}"));
    }
    if frames.is_empty() {
        return Err(CanLogError::NoFrames { path: path.to_owned() });
    }
    let count = frames.len();
    frames.retain(|(_, seen)| seen.time.is_some());
    if frames.is_empty() {
        return Err(CanLogError::NoTimes { path: path.to_owned(), frames: count });
    }
    account.leave_out_some("frames without a time", count - frames.len());
    let is_relative = matches!(&format, Format::Vector(dialect) if dialect.is_relative);
    let frames = settle(frames, is_relative, &mut account);
    Ok(CanLog { frames, account })
}

/// Whether the last frame lacks bytes that all frames of its identifier have.
fn is_cut(frames: &[(usize, SeenFrame)]) -> bool {
    let Some(((_, last), before)) = frames.split_last() else { return false };
    let mut same = before.iter().filter(|(_, seen)| seen.frame.id() == last.frame.id()).peekable();
    same.peek().is_some() && same.all(|(_, seen)| length(&seen.frame) > length(&last.frame))
}

fn length(frame: &AnyFrame) -> usize {
    frame.data().len()
}

/// Frames of one interface, or of the only one on which `ids` are heard.
///
/// # Errors
/// The interfaces that are there, if the one that was asked for is not, or if `ids` are heard on several.
pub fn choose_interface(log: &mut CanLog, wanted: Option<&str>, ids: &[Id]) -> Result<(), Vec<String>> {
    let mut heard: BTreeMap<&str, usize> = BTreeMap::new();
    for seen in &log.frames {
        *heard.entry(&seen.interface).or_default() += usize::from(ids.contains(&seen.frame.id()));
    }
    let names = |only_heard: bool| -> Vec<String> {
        heard.iter().filter(|(_, count)| !only_heard || **count > 0).map(|(name, _)| (*name).to_owned()).collect()
    };
    let chosen = match (wanted, names(true).as_slice()) {
        (Some(wanted), _) if heard.contains_key(wanted) => wanted.to_owned(),
        (Some(_), _) => return Err(names(false)),
        (None, [one]) => one.clone(),
        (None, []) => return Ok(()),
        (None, several) => return Err(several.to_vec()),
    };
    let before = log.frames.len();
    log.frames.retain(|seen| seen.interface == chosen);
    log.account.set_aside("frames of other interfaces", before - log.frames.len());
    Ok(())
}
