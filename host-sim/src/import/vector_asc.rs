//! What Vector's tools write as text (`.asc`): a line a frame, with the seconds since the measurement began, or since the line
//! before.
//!
//! ```text
//! date Mon May 4 10:00:00.000 am 2026
//! base hex  timestamps absolute
//!    0.015991 1  182             Rx   d 4 00 00 00 00
//!    0.016310 2  18FF1234x       Tx   d 8 01 02 03 04 05 06 07 08
//!    0.020000 CANFD   1 Rx       181                 1 0 4 4 2A 36 6C 2B
//! ```

use agv_core::measurement::Time;
use agv_wire::can::frame::{AnyFrame, FdFrame, Frame, Id, extended_id, standard_id};

use super::candump::SeenFrame;

/// What a line of such a file holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Line {
    /// A frame; its time is what is written.
    Frame(SeenFrame),
    /// An error frame.
    Error,
    /// Header, remark, statistics, or an event of the tool itself.
    Other,
}

/// What such a line looks like, for a refusal.
pub const EXPECTED: &str = "0.015991 1  182  Rx  d 4 00 00 00 00";

/// What the lines before say of those behind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dialect {
    /// Base of identifiers and bytes.
    pub base: u32,
    /// Whether times count from the line before.
    pub is_relative: bool,
}

impl Default for Dialect {
    fn default() -> Self {
        Self { base: 16, is_relative: false }
    }
}

/// Whether a text begins as such a file does.
#[must_use]
pub fn is_one(text: &str) -> bool {
    text.lines().take(10).any(|line| Dialect::default().take_header(line))
}

impl Dialect {
    /// Takes the line `base hex timestamps absolute`; whether it is that.
    pub fn take_header(&mut self, line: &str) -> bool {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let ["base", base @ ("hex" | "dec"), "timestamps", kind @ ("absolute" | "relative"), ..] = words[..] else {
            return false;
        };
        *self = Self { base: if base == "dec" { 10 } else { 16 }, is_relative: kind == "relative" };
        true
    }

    /// One line. None if it begins as a frame does and is none.
    #[must_use]
    pub fn parse_line(&self, line: &str) -> Option<Line> {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let [stamp, rest @ ..] = &words[..] else { return Some(Line::Other) };
        let Some(time) = seconds(stamp) else { return Some(Line::Other) };
        let (interface, frame) = match rest {
            ["CANFD", channel, _, rest @ ..] => (*channel, self.fd(rest)?),
            [channel, "ErrorFrame", ..] if is_channel(channel) => return Some(Line::Error),
            // What was asked to be sent is seen again when it is.
            [channel, _, "TxRq", ..] if is_channel(channel) => return Some(Line::Other),
            [channel, id, "Rx" | "Tx", rest @ ..] if is_channel(channel) => (*channel, self.classic(id, rest)?),
            _ => return Some(Line::Other),
        };
        let Some(frame) = frame else { return Some(Line::Error) };
        Some(Line::Frame(SeenFrame { time: Some(time), interface: interface.to_owned(), frame }))
    }

    fn id(&self, text: &str) -> Option<Id> {
        match text.strip_suffix(['x', 'X']) {
            Some(long) => u32::from_str_radix(long, self.base).ok().filter(|id| *id < 1 << 29).map(extended_id),
            None => u16::from_str_radix(text, self.base).ok().filter(|id| *id < 1 << 11).map(standard_id),
        }
    }

    fn bytes(&self, words: &[&str], length: usize) -> Option<Vec<u8>> {
        words.get(..length)?.iter().map(|word| u8::from_str_radix(word, self.base).ok()).collect()
    }

    /// Behind the direction: `d` and the length with the bytes, or `r` and the length, if it is told. The inner none for a
    /// frame that is no frame.
    fn classic(&self, id: &str, rest: &[&str]) -> Option<Option<AnyFrame>> {
        let id = self.id(id)?;
        let length = |word: &str| usize::from_str_radix(word, 16).ok().map(|length: usize| length.min(8));
        match rest {
            ["d", code, bytes @ ..] => Some(Some(Frame::new(id, &self.bytes(bytes, length(code)?)?)?.into())),
            ["r", code, ..] => Some(Some(Frame::remote(id, length(code).unwrap_or_default())?.into())),
            ["r"] => Some(Some(Frame::remote(id, 0)?.into())),
            _ => None,
        }
    }

    /// Behind the direction: identifier, a name or not, whether it was fast, whether the sender was passive, code of the length, the
    /// length, and the bytes.
    fn fd(&self, rest: &[&str]) -> Option<Option<AnyFrame>> {
        let [id, rest @ ..] = rest else { return None };
        if *id == "ErrorFrame" {
            return Some(None);
        }
        let is_flag = |word: &&str| matches!(*word, "0" | "1");
        let flags = if rest.first().is_some_and(is_flag) { rest } else { rest.get(1..)? };
        let [fast, _, _, length, bytes @ ..] = flags else { return None };
        let bytes = self.bytes(bytes, length.parse().ok()?)?;
        Some(Some(FdFrame::new(self.id(id)?, &bytes, *fast == "1")?.into()))
    }
}

fn is_channel(word: &str) -> bool {
    !word.is_empty() && word.bytes().all(|byte| byte.is_ascii_digit())
}

/// Seconds with a point; years, and versions with two points, are none.
fn seconds(text: &str) -> Option<Time> {
    let (whole, fraction) = text.split_once('.')?;
    let are_digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    (are_digits(whole) && are_digits(fraction)).then(|| text.parse().ok().map(Time::from_seconds))?
}
