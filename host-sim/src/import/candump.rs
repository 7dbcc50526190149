//! What `candump` writes: its log (`candump -l`, `-L`) and what it shows on a screen, both of which also name the interface,
//! with any of its options for the time (`-t a`, `d`, `z`, `A`), the direction (`-x`), colours, ASCII and raw lengths (`-8`).
//!
//! ```text
//! (1436509053.249713) vcan0 044#2A366C2B
//! (1436509053.849713) vcan0 1F334455#R4
//! (1436509054.049713) vcan0 123##1112233
//!   can0  589   [8]  4B 77 60 00 00 00 00 00
//!   can0  RX - -  589   {F}  4B 77 60 00 00 00 00 00   'Kw`.....'
//! ```

use std::borrow::Cow;
use std::fmt::Write;

use agv_core::measurement::Time;
use agv_wire::can::frame::{AnyFrame, FdFrame, Frame, Id, extended_id, standard_id};

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

/// What a line holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Line {
    /// A frame.
    Frame(SeenFrame),
    /// An error that the interface reported, or what it means (`-e`).
    Error,
    /// A frame of CAN XL, of which no sensor of a vehicle speaks.
    Xl,
    /// So many frames came too fast for candump.
    Dropped(usize),
}

/// What such a line looks like, for a refusal.
pub const EXPECTED: &str = "(1436509053.249713) can0 181#2A366C2B";

/// One line of a log or of a screen. None if it is neither.
#[must_use]
pub fn parse_line(line: &str) -> Option<Line> {
    let line = without_colours(line);
    // What an error means stands below it, behind a tabulator.
    if line.starts_with('\t') {
        return Some(Line::Error);
    }
    if let Some(lost) = line.trim_start().strip_prefix("DROPCOUNT: dropped ") {
        return Some(Line::Dropped(lost.split(' ').next()?.parse().ok()?));
    }
    let (time, rest) = match line.trim_start().strip_prefix('(') {
        Some(stamped) => {
            let (stamp, rest) = stamped.split_once(')')?;
            (Some(parse_time(stamp.trim())?), rest)
        }
        None => (None, &*line),
    };
    let mut words = rest.split_ascii_whitespace().peekable();
    let interface = words.next()?.to_owned();
    // The direction, and whether the frame was fast and the sender passive.
    if words.next_if(|word| matches!(*word, "RX" | "TX")).is_some() {
        for flag in ["B", "E"] {
            words.next_if(|word| *word == "-" || *word == flag)?;
        }
    }
    let word = words.next()?;
    let found = match word.split_once('#') {
        Some((id, content)) => parse_compact(id, content)?,
        None => parse_screen(word, &mut words)?,
    };
    Some(match found {
        Found::Frame(frame) => Line::Frame(SeenFrame { time, interface, frame }),
        Found::Error => Line::Error,
        Found::Xl => Line::Xl,
    })
}

/// What stands behind the interface.
enum Found {
    Frame(AnyFrame),
    Error,
    Xl,
}

/// The line without the escape sequences by which terminals change colours.
fn without_colours(line: &str) -> Cow<'_, str> {
    if !line.contains('\x1B') {
        return Cow::Borrowed(line);
    }
    let mut pieces = line.split("\x1B[");
    let first = pieces.next().unwrap_or_default().to_owned();
    let text = |piece: &str| piece.split_once('m').map_or(String::new(), |(_, text)| text.to_owned());
    Cow::Owned(pieces.fold(first, |line, piece| line + &text(piece)))
}

/// Seconds with their fraction, behind a date and a time of day or not.
fn parse_time(text: &str) -> Option<Time> {
    let (whole, fraction) = text.split_once('.')?;
    if fraction.is_empty() || !fraction.bytes().all(|digit| digit.is_ascii_digit()) {
        return None;
    }
    let digits = fraction.get(..6.min(fraction.len()))?;
    let micros: u64 = format!("{digits:0<6}").parse().ok()?;
    let seconds = match whole.split_once(' ') {
        Some((date, clock)) => seconds_of(date, clock)?,
        None => whole.parse().ok()?,
    };
    Some(Time::from_micros(seconds.checked_mul(1_000_000)?.checked_add(micros)?))
}

/// Seconds from 1970 to a date and a time of day, as if nobody ever moved their clocks.
fn seconds_of(date: &str, clock: &str) -> Option<u64> {
    let numbers =
        |text: &str, separator| -> Option<Vec<u64>> { text.split(separator).map(|word| word.parse().ok()).collect() };
    let (date, clock) = (numbers(date, '-')?, numbers(clock, ':')?);
    let ([year @ 1970..=9999, month @ 1..=12, day @ 1..=31], [hour @ 0..=23, minute @ 0..=59, second @ 0..=60]) =
        (date.as_slice(), clock.as_slice())
    else {
        return None;
    };
    // Years that begin in March have their odd day at the end (H. Hinnant, "chrono-compatible low-level date algorithms").
    let (year, month) = if *month > 2 { (*year, month - 3) } else { (year - 1, month + 9) };
    let days = 365 * year + year / 4 - year / 100 + year / 400 + (153 * month + 2) / 5 + day - 1;
    Some(((days - 719_468) * 24 + hour) * 3600 + minute * 60 + second)
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

/// A raw length from 9 to 15 says that there are 8 bytes (`-8`).
fn is_raw_length(text: &str) -> bool {
    matches!(text.as_bytes(), [b'9' | b'A'..=b'F' | b'a'..=b'f'])
}

fn parse_compact(id: &str, content: &str) -> Option<Found> {
    // Flags, kind of content, and acceptance field stand before the content of CAN XL.
    if content.split('#').next()?.matches(':').count() == 2 {
        return u32::from_str_radix(id, 16).is_ok().then_some(Found::Xl);
    }
    let Some(id) = parse_id(id)? else { return Some(Found::Error) };
    let content = match content.split_once('_') {
        Some((content, length)) if is_raw_length(length) => content,
        Some(_) => return None,
        None => content,
    };
    Some(Found::Frame(if let Some(fd) = content.strip_prefix('#') {
        let flags = u8::from_str_radix(fd.get(..1)?, 16).ok()?;
        FdFrame::new(id, &parse_bytes(fd.get(1..)?)?, flags & 1 != 0)?.into()
    } else if let Some(length) = content.strip_prefix('R') {
        let length = if length.is_empty() { 0 } else { length.parse().ok()? };
        Frame::remote(id, length)?.into()
    } else {
        Frame::new(id, &parse_bytes(content)?)?.into()
    }))
}

fn parse_screen<'a>(id: &str, words: &mut impl Iterator<Item = &'a str>) -> Option<Found> {
    let id = parse_id(id)?;
    let length_word = words.next()?;
    let length: usize = match length_word.strip_prefix('{').and_then(|word| word.strip_suffix('}')) {
        Some(raw) if is_raw_length(raw) => 8,
        Some(_) => return None,
        None => length_word.strip_prefix('[')?.strip_suffix(']')?.parse().ok()?,
    };
    let Some(id) = id else { return Some(Found::Error) };
    let rest: Vec<&str> = words.take(length.max(1)).collect();
    if rest.first() == Some(&"remote") {
        return Some(Found::Frame(Frame::remote(id, length)?.into()));
    }
    let bytes = if length == 0 { Vec::new() } else { shown_bytes(&rest, length)? };
    // Two digits of length are how the screen tells FD frames.
    let is_fd = length_word.len() == 4;
    Some(Found::Frame(if is_fd { FdFrame::new(id, &bytes, false)?.into() } else { Frame::new(id, &bytes)?.into() }))
}

/// Bytes as words, as one word from the last to the first (`-S`), or as words of binary digits (`-i`).
fn shown_bytes(words: &[&str], length: usize) -> Option<Vec<u8>> {
    let bytes: Option<Vec<u8>> = match words {
        [first, ..] if first.contains('`') => first.rsplit('`').map(|word| u8::from_str_radix(word, 16).ok()).collect(),
        [first, ..] if first.len() == 8 => words.iter().map(|word| u8::from_str_radix(word, 2).ok()).collect(),
        _ => parse_bytes(&words.concat()),
    };
    bytes.filter(|bytes| bytes.len() == length)
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
