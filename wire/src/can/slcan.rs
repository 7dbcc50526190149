//! CAN frames as text on a serial line: the protocol of Lawicel's adapters (CANUSB and CAN232 manuals), and the FD commands
//! that CANable's firmware adds to it.
//!
//! A line ends with a carriage return. The adapter answers a command with a carriage return, or with BEL if it refuses.
//!
//! | line | meaning |
//! |---|---|
//! | `tiiildd..` `Tiiiiiiiildd..` | data frame, 11 and 29 bits of identifier |
//! | `riiil` `Riiiiiiiil` | remote frame |
//! | `diiildd..` `Diiiiiiiildd..` | FD frame, one bit rate (CANable) |
//! | `biiildd..` `Biiiiiiiildd..` | FD frame, data at the faster bit rate (CANable) |
//! | `O` `L` `C` | open, open to listen only, close |
//! | `Sn` `Yn` | bit rate; FD data bit rate (CANable) |
//! | `Zn` | time stamps off or on: received frames end with four digits, ms modulo 60000 |
//! | `V` `N` `F` | ask for version, serial number, status; answered `Vhhss`, `Nxxxx`, `Fhh` |
//! | `z` `Z` | a frame of 11 or 29 bits has been taken for sending |
//!
//! There is no checksum: a line that was damaged into another valid line cannot be told from it.

use heapless::Vec;

use super::frame::{AnyFrame, CLASSIC_LENGTH, ExtendedId, FD_LENGTH, FdFrame, Frame, Id, StandardId};

/// Length of the longest line, with its carriage return: a fast FD frame with 29 bits, 64 bytes and a time stamp.
pub const MAX_LINE: usize = 1 + 8 + 1 + 2 * FD_LENGTH + 4 + 1;

const END: u8 = b'\r';
const BELL: u8 = 7;

/// A line as bytes, with its end.
pub type Line = Vec<u8, MAX_LINE>;

/// Bit rates that have a number in the protocol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum BitRate {
    /// 10 kbit/s.
    Kbit10 = b'0',
    /// 20 kbit/s.
    Kbit20 = b'1',
    /// 50 kbit/s.
    Kbit50 = b'2',
    /// 100 kbit/s.
    Kbit100 = b'3',
    /// 125 kbit/s.
    Kbit125 = b'4',
    /// 250 kbit/s.
    Kbit250 = b'5',
    /// 500 kbit/s.
    Kbit500 = b'6',
    /// 800 kbit/s.
    Kbit800 = b'7',
    /// 1 Mbit/s.
    Mbit1 = b'8',
}

impl BitRate {
    const ALL: [(Self, u32); 9] = [
        (Self::Kbit10, 10_000),
        (Self::Kbit20, 20_000),
        (Self::Kbit50, 50_000),
        (Self::Kbit100, 100_000),
        (Self::Kbit125, 125_000),
        (Self::Kbit250, 250_000),
        (Self::Kbit500, 500_000),
        (Self::Kbit800, 800_000),
        (Self::Mbit1, 1_000_000),
    ];

    /// The rate of that many bit/s, if the protocol has it.
    #[must_use]
    pub fn from_bits_per_second(rate: u32) -> Option<Self> {
        Self::ALL.iter().find(|(_, known)| *known == rate).map(|(bit_rate, _)| *bit_rate)
    }

    fn from_digit(digit: u8) -> Option<Self> {
        Self::ALL.iter().map(|(bit_rate, _)| *bit_rate).find(|bit_rate| *bit_rate as u8 == digit)
    }
}

/// What the host asks of the adapter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Take part in the traffic.
    Open,
    /// Listen without acknowledging.
    ListenOnly,
    /// Leave the bus.
    Close,
    /// Bit rate; only while closed.
    BitRate(BitRate),
    /// FD data bit rate, Mbit/s, 0 to 9 (CANable: 2 and 5; unverified for other adapters).
    DataBitRate(u8),
    /// Time stamps of received frames.
    TimeStamps(bool),
    /// Ask for the status flags.
    ReadStatus,
    /// Ask for the version.
    ReadVersion,
    /// Ask for the serial number.
    ReadSerial,
}

/// One line, in either direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Message {
    /// A frame: to be sent, or received from the bus, then perhaps with a time stamp in ms modulo 60000.
    Frame {
        /// The frame.
        frame: AnyFrame,
        /// When the adapter received it, ms modulo 60000.
        time_stamp: Option<u16>,
    },
    /// To the adapter.
    Command(Command),
    /// The adapter has done what it was told.
    Acknowledged,
    /// The adapter will send the frame; true for one of 29 bits.
    Accepted {
        /// Whether the frame has 29 bits of identifier.
        is_extended: bool,
    },
    /// The adapter has not done what it was told.
    Refused,
    /// Status flags: bit 0 receive queue full, 1 transmit queue full, 2 error warning, 3 overrun, 5 error passive,
    /// 6 arbitration lost, 7 bus error.
    Status(u8),
    /// Version of hardware and software, as four hexadecimal digits.
    Version(u16),
    /// Serial number, four characters.
    Serial([u8; 4]),
}

/// Why a line means nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SlcanError {
    /// The line begins with no known letter.
    Unknown,
    /// The line is shorter or longer than its letter and length demand.
    Length,
    /// A digit is no digit, or a number is out of range.
    Digit,
    /// The line was longer than any line can be.
    TooLong,
}

impl core::fmt::Display for SlcanError {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter.write_str(match self {
            Self::Unknown => "the line begins with no known letter",
            Self::Length => "the line has a wrong length",
            Self::Digit => "the line has a wrong digit",
            Self::TooLong => "the line has no end",
        })
    }
}

/// Adds bytes to a line that has room for every message there is.
struct Printer(Line);

impl Printer {
    fn byte(&mut self, byte: u8) {
        // The longest message fits: MAX_LINE is its length.
        let _ = self.0.push(byte);
    }

    fn digits(&mut self, number: u32, digits: u32) {
        for digit in (0..digits).rev() {
            let nibble = (number >> (4 * digit)) as u8 & 0xF;
            self.byte(if nibble < 10 { b'0' + nibble } else { b'A' + nibble - 10 });
        }
    }

    fn id(&mut self, letters: [u8; 2], id: Id) {
        match id {
            Id::Standard(id) => {
                self.byte(letters[0]);
                self.digits(u32::from(id.as_raw()), 3);
            }
            Id::Extended(id) => {
                self.byte(letters[1]);
                self.digits(id.as_raw(), 8);
            }
        }
    }

    fn frame(&mut self, frame: &AnyFrame) {
        match frame {
            AnyFrame::Classic(frame) => {
                self.id(if frame.is_remote() { *b"rR" } else { *b"tT" }, frame.id());
                self.digits(frame.length() as u32, 1);
            }
            AnyFrame::Fd(frame) => {
                self.id(if frame.is_fast() { *b"bB" } else { *b"dD" }, frame.id());
                self.digits(u32::from(frame.length_code()), 1);
            }
        }
        for byte in frame.data() {
            self.digits(u32::from(*byte), 2);
        }
    }
}

impl Message {
    /// The message as a line. Of a data bit rate only the last decimal digit counts.
    #[must_use]
    pub fn encode(&self) -> Line {
        let mut line = Printer(Line::new());
        match self {
            Self::Frame { frame, time_stamp } => {
                line.frame(frame);
                if let Some(time_stamp) = time_stamp {
                    line.digits(u32::from(*time_stamp), 4);
                }
            }
            Self::Command(command) => {
                let (letter, digit) = match command {
                    Command::Open => (b'O', None),
                    Command::ListenOnly => (b'L', None),
                    Command::Close => (b'C', None),
                    Command::BitRate(rate) => (b'S', Some(*rate as u8)),
                    Command::DataBitRate(rate) => (b'Y', Some(b'0' + rate % 10)),
                    Command::TimeStamps(on) => (b'Z', Some(b'0' + u8::from(*on))),
                    Command::ReadStatus => (b'F', None),
                    Command::ReadVersion => (b'V', None),
                    Command::ReadSerial => (b'N', None),
                };
                line.byte(letter);
                if let Some(digit) = digit {
                    line.byte(digit);
                }
            }
            Self::Acknowledged => {}
            Self::Accepted { is_extended } => line.byte(if *is_extended { b'Z' } else { b'z' }),
            Self::Refused => {
                line.byte(BELL);
                return line.0;
            }
            Self::Status(flags) => {
                line.byte(b'F');
                line.digits(u32::from(*flags), 2);
            }
            Self::Version(version) => {
                line.byte(b'V');
                line.digits(u32::from(*version), 4);
            }
            Self::Serial(serial) => {
                line.byte(b'N');
                for byte in serial {
                    line.byte(*byte);
                }
            }
        }
        line.byte(END);
        line.0
    }

    /// The message of a line without its end.
    ///
    /// # Errors
    /// See [`SlcanError`].
    pub fn decode(line: &[u8]) -> Result<Self, SlcanError> {
        let Some((&letter, rest)) = line.split_first() else {
            return Ok(Self::Acknowledged);
        };
        Ok(match (letter, rest) {
            (b't' | b'T' | b'r' | b'R' | b'd' | b'D' | b'b' | b'B', _) => return decode_frame(letter, rest),
            (b'O', []) => Self::Command(Command::Open),
            (b'L', []) => Self::Command(Command::ListenOnly),
            (b'C', []) => Self::Command(Command::Close),
            (b'S', [digit]) => Self::Command(Command::BitRate(BitRate::from_digit(*digit).ok_or(SlcanError::Digit)?)),
            (b'Y', [digit @ b'0'..=b'9']) => Self::Command(Command::DataBitRate(digit - b'0')),
            (b'Z', [digit @ b'0'..=b'1']) => Self::Command(Command::TimeStamps(*digit == b'1')),
            (b'Y' | b'Z', [_]) => return Err(SlcanError::Digit),
            (b'z', []) => Self::Accepted { is_extended: false },
            (b'Z', []) => Self::Accepted { is_extended: true },
            (b'F', []) => Self::Command(Command::ReadStatus),
            (b'F', [_, _]) => Self::Status(number(rest)? as u8),
            (b'V', []) => Self::Command(Command::ReadVersion),
            (b'V', [_, _, _, _]) => Self::Version(number(rest)? as u16),
            (b'N', []) => Self::Command(Command::ReadSerial),
            (b'N', [a, b, c, d]) => Self::Serial([*a, *b, *c, *d]),
            (b'O' | b'L' | b'C' | b'S' | b'Y' | b'Z' | b'z' | b'F' | b'V' | b'N', _) => return Err(SlcanError::Length),
            _ => return Err(SlcanError::Unknown),
        })
    }
}

impl From<Command> for Message {
    fn from(command: Command) -> Self {
        Self::Command(command)
    }
}

impl<T: Into<AnyFrame>> From<T> for Message {
    fn from(frame: T) -> Self {
        Self::Frame { frame: frame.into(), time_stamp: None }
    }
}

fn digit(character: u8) -> Result<u8, SlcanError> {
    match character {
        b'0'..=b'9' => Ok(character - b'0'),
        b'A'..=b'F' => Ok(character - b'A' + 10),
        b'a'..=b'f' => Ok(character - b'a' + 10),
        _ => Err(SlcanError::Digit),
    }
}

/// At most eight hexadecimal digits.
fn number(digits: &[u8]) -> Result<u32, SlcanError> {
    digits.iter().try_fold(0, |number, character| Ok(number << 4 | u32::from(digit(*character)?)))
}

fn decode_frame(letter: u8, rest: &[u8]) -> Result<Message, SlcanError> {
    let is_extended = letter.is_ascii_uppercase();
    let (id, rest) = rest.split_at_checked(if is_extended { 8 } else { 3 }).ok_or(SlcanError::Length)?;
    let id = number(id)?;
    let id =
        if is_extended { ExtendedId::new(id).map(Id::Extended) } else { StandardId::new(id as u16).map(Id::Standard) };
    let id = id.ok_or(SlcanError::Digit)?;
    let (code, rest) = rest.split_first().ok_or(SlcanError::Length)?;
    let code = digit(*code)?;
    let is_classic = matches!(letter.to_ascii_lowercase(), b't' | b'r');
    let is_remote = letter.eq_ignore_ascii_case(&b'r');
    let length = FdFrame::length_of_code(code).filter(|length| !is_classic || *length <= CLASSIC_LENGTH);
    let length = length.ok_or(SlcanError::Digit)?;
    let carried = if is_remote { 0 } else { length };
    let (text, stamp) = rest.split_at_checked(2 * carried).ok_or(SlcanError::Length)?;
    let mut bytes = [0; FD_LENGTH];
    for (byte, pair) in bytes.iter_mut().zip(text.as_chunks::<2>().0) {
        *byte = digit(pair[0])? << 4 | digit(pair[1])?;
    }
    let time_stamp = match stamp.len() {
        0 => None,
        4 => Some(number(stamp)? as u16),
        _ => return Err(SlcanError::Length),
    };
    let data = bytes.get(..carried).ok_or(SlcanError::Length)?;
    let frame = if is_remote {
        Frame::remote(id, length).map(AnyFrame::from)
    } else if is_classic {
        Frame::new(id, data).map(AnyFrame::from)
    } else {
        FdFrame::new(id, data, letter.eq_ignore_ascii_case(&b'b')).map(AnyFrame::from)
    };
    Ok(Message::Frame { frame: frame.ok_or(SlcanError::Length)?, time_stamp })
}

/// Finds messages in a stream of bytes. After a line that means nothing it goes on with the next one.
#[derive(Clone, Debug, Default)]
pub struct Decoder {
    line: Line,
    is_too_long: bool,
}

impl Decoder {
    /// A decoder at the beginning of a line.
    #[must_use]
    pub const fn new() -> Self {
        Self { line: Line::new(), is_too_long: false }
    }

    /// Takes the next byte; gives a message if one ends here.
    pub fn push(&mut self, byte: u8) -> Option<Result<Message, SlcanError>> {
        match byte {
            END => {
                let outcome = if self.is_too_long { Err(SlcanError::TooLong) } else { Message::decode(&self.line) };
                self.restart();
                Some(outcome)
            }
            // A refusal stands alone; what came before it was cut.
            BELL => {
                self.restart();
                Some(Ok(Message::Refused))
            }
            // Some adapters send line feeds too.
            b'\n' => None,
            _ => {
                self.is_too_long |= self.line.push(byte).is_err();
                None
            }
        }
    }

    fn restart(&mut self) {
        self.line.clear();
        self.is_too_long = false;
    }
}
