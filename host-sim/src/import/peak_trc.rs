//! What PCAN-View and its relatives write (`.trc`): a line a frame, with the milliseconds since the trace began, in columns that
//! depend on the version of the file.
//!
//! ```text
//! ;$FILEVERSION=1.1
//!      1)      1059.9  Rx         0182  4  00 00 00 00
//!
//! ;$FILEVERSION=2.1
//! ;$COLUMNS=N,O,T,B,I,d,R,L,D
//!       1      1059.900 DT 1      0182 Rx -  4    00 00 00 00
//! ```

use agv_core::measurement::Time;
use agv_wire::can::frame::{AnyFrame, FdFrame, Frame, Id, extended_id, standard_id};

use super::candump::SeenFrame;

/// What a line of such a file holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Line {
    /// A frame.
    Frame(SeenFrame),
    /// An error frame, a warning, or counters of errors.
    Error,
    /// A header or a remark.
    Other,
}

/// What such a line looks like, for a refusal.
pub const EXPECTED: &str = "1)  1059.9  Rx  0182  4  00 00 00 00";

/// Columns of a version: N number, O time, T kind, B bus, I identifier, d direction, R reserved, L or l length, D bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Columns(Vec<char>);

/// Columns of the versions that do not state them.
const OLD: [(&str, &str); 4] = [("1.0", "NOILD"), ("1.1", "NOTILD"), ("1.2", "NOBTILD"), ("1.3", "NOBTIRLD")];

/// The columns of a file that begins as such files do. None for another file; an error names the version that is not known.
#[must_use]
pub fn columns(text: &str) -> Option<Result<Columns, String>> {
    let header = |name: &str| text.lines().take(100).find_map(|line| line.trim().strip_prefix(name));
    let version = header(";$FILEVERSION=")?.trim();
    if let Some(columns) = header(";$COLUMNS=") {
        return Some(Ok(Columns(columns.trim().split(',').filter_map(|word| word.chars().next()).collect())));
    }
    let old = OLD.iter().find(|(known, _)| *known == version);
    Some(old.map(|(_, columns)| Columns(columns.chars().collect())).ok_or_else(|| version.to_owned()))
}

/// What kind of frame a line holds.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Classic,
    Remote,
    Fd { is_fast: bool },
}

impl Columns {
    /// One line. None if it is no line of these columns.
    #[must_use]
    pub fn parse_line(&self, line: &str) -> Option<Line> {
        if line.trim_start().starts_with(';') {
            return Some(Line::Other);
        }
        let mut words = line.split_ascii_whitespace();
        let (mut time, mut id, mut kind, mut bus, mut length) = (None, None, Kind::Classic, "1", None);
        for column in &self.0 {
            match column {
                // The bytes are what is left.
                'D' => break,
                'O' => time = Some(milliseconds(words.next()?)?),
                'I' => id = Some(words.next()?),
                'B' => bus = words.next()?,
                'L' => length = Some((words.next()?.parse::<usize>().ok()?, true)),
                'l' => length = Some((words.next()?.parse::<usize>().ok()?, false)),
                'T' => match words.next()? {
                    "Rx" | "Tx" | "DT" => {}
                    "RR" => kind = Kind::Remote,
                    "FD" | "FE" => kind = Kind::Fd { is_fast: false },
                    "FB" | "BI" => kind = Kind::Fd { is_fast: true },
                    "Warng" | "Error" | "ST" | "EC" | "ER" => return Some(Line::Error),
                    "EV" => return Some(Line::Other),
                    _ => return None,
                },
                _ => {
                    words.next()?;
                }
            }
        }
        let (time, id, (length, is_code)) = (time?, id?, length?);
        // So did the first version write what the hardware reported.
        if id == "FFFFFFFF" {
            return Some(Line::Error);
        }
        let length = match kind {
            Kind::Fd { .. } if is_code => FdFrame::length_of_code(u8::try_from(length).ok()?)?,
            Kind::Fd { .. } => length,
            _ => length.min(8),
        };
        let rest: Vec<&str> = words.collect();
        let frame = frame(parse_id(id)?, kind, length, &rest)?;
        Some(Line::Frame(SeenFrame { time: Some(time), interface: bus.to_owned(), frame }))
    }
}

fn frame(id: Id, kind: Kind, length: usize, rest: &[&str]) -> Option<AnyFrame> {
    if kind == Kind::Remote || rest.first() == Some(&"RTR") {
        return Some(Frame::remote(id, length)?.into());
    }
    let bytes: Vec<u8> =
        rest.get(..length)?.iter().map(|word| u8::from_str_radix(word, 16).ok()).collect::<Option<_>>()?;
    match kind {
        Kind::Fd { is_fast } => Some(FdFrame::new(id, &bytes, is_fast)?.into()),
        _ => Some(Frame::new(id, &bytes)?.into()),
    }
}

/// Four digits are a standard identifier, eight an extended one.
fn parse_id(text: &str) -> Option<Id> {
    let number = u32::from_str_radix(text, 16).ok()?;
    match text.len() {
        3 | 4 if number < 1 << 11 => Some(standard_id(number as u16)),
        8 if number < 1 << 29 => Some(extended_id(number)),
        _ => None,
    }
}

fn milliseconds(text: &str) -> Option<Time> {
    let number: f64 = text.parse().ok()?;
    (number.is_finite() && number >= 0.0).then(|| Time::from_seconds(number * 1e-3))
}
