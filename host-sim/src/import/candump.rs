//! What `candump` writes: its log (`candump -l`) and what it shows on a screen, both of which also name the interface.
//!
//! ```text
//! (1436509053.249713) vcan0 044#2A366C2B
//! (1436509053.849713) vcan0 1F334455#R4
//! (1436509054.049713) vcan0 123##1112233
//!   can0  589   [8]  4B 77 60 00 00 00 00 00
//! ```

use std::fmt::Write;
use std::path::Path;

use agv_core::measurement::Time;
use agv_wire::can::frame::{AnyFrame, FdFrame, Frame, Id, extended_id, standard_id};

use crate::text_file::{self, TextFileError};

/// One frame as it was seen on an interface.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SeenFrame {
    /// When, on the clock of the host that saw it; a screen without `-t` shows none.
    pub time: Option<Time>,
    /// Interface.
    pub interface: String,
    /// The frame.
    pub frame: AnyFrame,
}

/// The frames of a log, in the order of the file. Error frames are left out.
///
/// # Errors
/// If the file cannot be read or a line is no frame.
pub fn read(path: &Path) -> Result<Vec<SeenFrame>, TextFileError> {
    let text = text_file::read_unpacked(path, "a log of candump")?;
    let mut frames = Vec::new();
    for (line, text) in (1..).zip(text.lines()).filter(|(_, text)| !text.trim().is_empty()) {
        match parse_line(text) {
            Some(Line::Frame(frame)) => frames.push(frame),
            Some(Line::Error) => {}
            None => return Err(TextFileError::of_line(path, line, "this is no frame as candump writes it")),
        }
    }
    Ok(frames)
}

/// What a line holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Line {
    /// A frame.
    Frame(SeenFrame),
    /// An error that the interface reported.
    Error,
}

/// One line of a log or of a screen. None if it is neither.
#[must_use]
pub fn parse_line(line: &str) -> Option<Line> {
    let mut words = line.split_ascii_whitespace().peekable();
    let stamp = words.next_if(|word| word.starts_with('('));
    let time = match stamp {
        Some(stamp) => Some(parse_time(stamp.strip_prefix('(')?.strip_suffix(')')?)?),
        None => None,
    };
    let interface = words.next()?.to_owned();
    let word = words.next()?;
    let frame = match word.split_once('#') {
        Some((id, content)) => parse_compact(id, content)?,
        None => parse_screen(word, &mut words)?,
    };
    Some(match frame {
        Some(frame) => Line::Frame(SeenFrame { time, interface, frame }),
        None => Line::Error,
    })
}

fn parse_time(text: &str) -> Option<Time> {
    let (seconds, fraction) = text.split_once('.')?;
    let digits = fraction.get(..6.min(fraction.len()))?;
    let micros: u64 = format!("{digits:0<6}").parse().ok()?;
    Some(Time::from_micros(seconds.parse::<u64>().ok()?.checked_mul(1_000_000)?.checked_add(micros)?))
}

/// The identifier; the inner none for an error frame.
fn parse_id(text: &str) -> Option<Option<Id>> {
    let number = u32::from_str_radix(text, 16).ok()?;
    match text.len() {
        3 if number <= 0x7FF => Some(Some(standard_id(number as u16))),
        8 if number & 0x2000_0000 != 0 => Some(None),
        8 if number <= 0x1FFF_FFFF => Some(Some(extended_id(number))),
        _ => None,
    }
}

fn parse_bytes(text: &str) -> Option<Vec<u8>> {
    let digits: Vec<u8> = text.bytes().filter(|byte| *byte != b'.').collect();
    let (pairs, rest) = digits.as_chunks::<2>();
    let byte = |pair: &[u8; 2]| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok();
    if rest.is_empty() { pairs.iter().map(byte).collect() } else { None }
}

fn parse_compact(id: &str, content: &str) -> Option<Option<AnyFrame>> {
    let Some(id) = parse_id(id)? else { return Some(None) };
    let frame = if let Some(fd) = content.strip_prefix('#') {
        let flags = u8::from_str_radix(fd.get(..1)?, 16).ok()?;
        FdFrame::new(id, &parse_bytes(fd.get(1..)?)?, flags & 1 != 0)?.into()
    } else if let Some(length) = content.strip_prefix('R') {
        let length = if length.is_empty() { 0 } else { length.parse().ok()? };
        Frame::remote(id, length)?.into()
    } else {
        Frame::new(id, &parse_bytes(content)?)?.into()
    };
    Some(Some(frame))
}

fn parse_screen<'a>(id: &str, words: &mut impl Iterator<Item = &'a str>) -> Option<Option<AnyFrame>> {
    let id = parse_id(id)?;
    let length_word = words.next()?;
    let length: usize = length_word.strip_prefix('[')?.strip_suffix(']')?.parse().ok()?;
    let Some(id) = id else { return Some(None) };
    let rest: Vec<&str> = words.take(length.max(1)).collect();
    if rest.first() == Some(&"remote") {
        return Some(Some(Frame::remote(id, length)?.into()));
    }
    let bytes = parse_bytes(&rest.concat()).filter(|bytes| bytes.len() == length)?;
    // Two digits of length are how the screen tells FD frames.
    let is_fd = length_word.len() == 4;
    Some(Some(if is_fd { FdFrame::new(id, &bytes, false)?.into() } else { Frame::new(id, &bytes)?.into() }))
}

fn id_text(id: Id) -> String {
    match id {
        Id::Standard(id) => format!("{:03X}", id.as_raw()),
        Id::Extended(id) => format!("{:08X}", id.as_raw()),
    }
}

/// A frame as a line of a log, without its end. A frame without a time gets zero.
#[must_use]
pub fn log_line(seen: &SeenFrame) -> String {
    let micros = seen.time.unwrap_or_default().micros();
    let mut line = format!("({:010}.{:06}) {} ", micros / 1_000_000, micros % 1_000_000, seen.interface);
    line += &id_text(seen.frame.id());
    match &seen.frame {
        AnyFrame::Classic(frame) if frame.is_remote() => {
            line += "#R";
            if frame.length() > 0 {
                line += &frame.length().to_string();
            }
        }
        AnyFrame::Classic(_) => line.push('#'),
        AnyFrame::Fd(frame) => line += if frame.is_fast() { "##1" } else { "##0" },
    }
    for byte in seen.frame.data() {
        // Writing into a string cannot fail.
        let _ = write!(line, "{byte:02X}");
    }
    line
}

/// A frame as a line on the screen.
#[must_use]
pub fn screen_line(interface: &str, frame: &AnyFrame) -> String {
    let mut line = format!("  {interface}  {:>8}", id_text(frame.id()));
    let _ = match frame {
        AnyFrame::Classic(frame) => write!(line, "   [{}] ", frame.length()),
        AnyFrame::Fd(frame) => write!(line, "  [{:02}] ", frame.data().len()),
    };
    for byte in frame.data() {
        let _ = write!(line, " {byte:02X}");
    }
    if frame.classic().is_some_and(Frame::is_remote) {
        line += " remote request";
    }
    line
}
