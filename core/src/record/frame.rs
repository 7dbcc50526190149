//! Frames: how a record is found, numbered and checked in a stream of bytes.

use core::fmt;

use crc::{CRC_32_ISO_HDLC, Crc, Table};

/// First bytes of every frame. The first of them is no ASCII, so a text file never begins like a log.
pub const MAGIC: [u8; 4] = [0xD6, b'A', b'G', b'V'];

/// Version of the kinds and payloads that this program writes, and the only one that it reads.
pub const FORMAT_VERSION: u8 = 11;

/// Length of what stands before the payload, bytes.
pub const HEADER_LENGTH: usize = 12;

/// Length of what stands behind the payload, bytes.
pub const CHECKSUM_LENGTH: usize = 4;

/// Greatest length of a payload, bytes.
pub const MAX_PAYLOAD: usize = 32 * 1024;

/// Greatest length of a frame, bytes. A reader that is given this many bytes always gets ahead.
pub const MAX_FRAME: usize = HEADER_LENGTH + MAX_PAYLOAD + CHECKSUM_LENGTH;

/// Sixteen bytes a step: the table costs 16 KiB, and a scan of 1440 beams is checked in microseconds.
static CHECKSUM: Crc<u32, Table<16>> = Crc::<u32, Table<16>>::new(&CRC_32_ISO_HDLC);

/// A frame whose checksum is right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a> {
    /// Kind of the record.
    pub kind: u8,
    /// Sequence number; each frame's is one more than that of the frame before, wrapping.
    pub sequence: u32,
    /// Encoded content.
    pub payload: &'a [u8],
}

impl Frame<'_> {
    /// Length of the whole frame, bytes.
    #[must_use]
    pub fn length(&self) -> usize {
        HEADER_LENGTH + self.payload.len() + CHECKSUM_LENGTH
    }
}

/// Why bytes of a log could not be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DamageReason {
    /// No frame begins there.
    Magic,
    /// The length is impossible.
    Length,
    /// The checksum is wrong.
    Checksum,
    /// The data end in the middle of a frame.
    Cut,
    /// The frame is whole, but of another format version.
    Version(u8),
    /// The frame is whole, but this version knows no such kind of record.
    Kind(u8),
    /// The frame is whole, but its payload is not what its kind demands, or exceeds the reader's capacity.
    Payload,
    /// Frames are missing or repeated. No bytes are skipped.
    Sequence {
        /// The number that should have come.
        expected: u32,
        /// The number that came.
        found: u32,
    },
}

/// A place at which a log is not as it was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Damage {
    /// Where it begins, bytes from the start of the log.
    pub offset: u64,
    /// How many bytes are skipped.
    pub skipped: u64,
    /// What is wrong at its beginning.
    pub reason: DamageReason,
}

impl fmt::Display for DamageReason {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Magic => write!(formatter, "no record begins there"),
            Self::Length => write!(formatter, "the record's length is wrong"),
            Self::Checksum => write!(formatter, "the record's checksum is wrong"),
            Self::Cut => write!(formatter, "the log is cut off"),
            Self::Version(version) => {
                write!(formatter, "the record has format version {version}, this program reads {FORMAT_VERSION}")
            }
            Self::Kind(kind) => write!(formatter, "records of kind {kind} are unknown"),
            Self::Payload => write!(formatter, "the record's content is not what its kind demands"),
            Self::Sequence { expected, found } => {
                write!(formatter, "record {expected} should have come, but {found} came")
            }
        }
    }
}

impl fmt::Display for Damage {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "at byte {}: {}, {} bytes skipped", self.offset, self.reason, self.skipped)
    }
}

/// What [`FrameReader::step`] found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameStep<'a> {
    /// A good frame.
    Frame {
        /// Where the frame begins, bytes from the start of the log.
        offset: u64,
        /// The frame.
        frame: Frame<'a>,
    },
    /// Bytes that are no good frame.
    Damage(Damage),
    /// Nothing yet: call again with more bytes behind those that were not consumed.
    NeedMore,
    /// Nothing any more.
    End,
}

/// Finds good frames in a stream of bytes that arrives in pieces. It holds no bytes itself.
#[derive(Clone, Debug, Default)]
pub struct FrameReader {
    /// Bytes consumed so far.
    offset: u64,
    /// Beginning of the damage that is being skipped.
    damage: Option<(u64, DamageReason)>,
    /// Sequence number of the next frame, where it is known.
    expected: Option<u32>,
}

/// What the beginning of a slice is.
enum Parsed<'a> {
    Frame(Frame<'a>),
    Incomplete,
    Bad(DamageReason),
}

fn checksum(bytes: &[u8]) -> u32 {
    let mut digest = CHECKSUM.digest();
    // Of pieces whose length is known the compiler sees that the table is never read beyond its end.
    let (blocks, rest) = bytes.as_chunks::<16>();
    for block in blocks {
        digest.update(block);
    }
    for byte in rest {
        digest.update(core::slice::from_ref(byte));
    }
    digest.finalize()
}

/// Puts header and checksum around the payload that already stands in `buffer[HEADER_LENGTH..]`. None if the buffer is too
/// short or the payload too long; else the length of the frame.
pub(super) fn seal(kind: u8, sequence: u32, payload_length: usize, buffer: &mut [u8]) -> Option<usize> {
    if payload_length > MAX_PAYLOAD {
        return None;
    }
    let length = u16::try_from(payload_length).ok()?;
    let checked = HEADER_LENGTH + payload_length;
    buffer.get_mut(0..4)?.copy_from_slice(&MAGIC);
    buffer.get_mut(4..6)?.copy_from_slice(&[FORMAT_VERSION, kind]);
    buffer.get_mut(6..8)?.copy_from_slice(&length.to_le_bytes());
    buffer.get_mut(8..12)?.copy_from_slice(&sequence.to_le_bytes());
    let checksum = checksum(buffer.get(..checked)?);
    buffer.get_mut(checked..checked + CHECKSUM_LENGTH)?.copy_from_slice(&checksum.to_le_bytes());
    Some(checked + CHECKSUM_LENGTH)
}

fn parse(bytes: &[u8]) -> Parsed<'_> {
    if !bytes.iter().zip(MAGIC.iter()).all(|(a, b)| a == b) {
        return Parsed::Bad(DamageReason::Magic);
    }
    let Some(header) = bytes.first_chunk::<HEADER_LENGTH>() else {
        return Parsed::Incomplete;
    };
    let [_, _, _, _, version, kind, l0, l1, s0, s1, s2, s3] = *header;
    let length = usize::from(u16::from_le_bytes([l0, l1]));
    if length > MAX_PAYLOAD {
        return Parsed::Bad(DamageReason::Length);
    }
    let checked_length = HEADER_LENGTH + length;
    let Some((checked, rest)) = bytes.split_at_checked(checked_length) else {
        return Parsed::Incomplete;
    };
    let Some(stated) = rest.first_chunk::<CHECKSUM_LENGTH>() else {
        return Parsed::Incomplete;
    };
    if checksum(checked) != u32::from_le_bytes(*stated) {
        return Parsed::Bad(DamageReason::Checksum);
    }
    if version != FORMAT_VERSION {
        return Parsed::Bad(DamageReason::Version(version));
    }
    let payload = checked.get(HEADER_LENGTH..).unwrap_or_default();
    Parsed::Frame(Frame { kind, sequence: u32::from_le_bytes([s0, s1, s2, s3]), payload })
}

/// The next place, not before `from`, at which a frame may begin: the magic, or as much of it as there is.
fn next_candidate(bytes: &[u8], from: usize) -> usize {
    let rest = bytes.get(from..).unwrap_or_default();
    let [first, ..] = MAGIC;
    let skipped = rest
        .iter()
        .enumerate()
        .filter(|(_, byte)| **byte == first)
        .find(|(index, _)| rest.iter().skip(*index).zip(MAGIC.iter()).all(|(a, b)| a == b))
        .map_or(rest.len(), |(index, _)| index);
    from + skipped
}

impl FrameReader {
    /// A reader at the start of a log.
    #[must_use]
    pub const fn new() -> Self {
        Self { offset: 0, damage: None, expected: None }
    }

    /// How many bytes have been consumed since the start of the log.
    #[must_use]
    pub const fn offset(&self) -> u64 {
        self.offset
    }

    /// Looks for the next frame at the beginning of `bytes`, the first bytes of the log that are not consumed yet. Returns
    /// how many of them are consumed now, and what was found; what follows them must stand at the beginning of the next
    /// call. `is_last` says that nothing follows `bytes`. With at least [`MAX_FRAME`] bytes, or `is_last`, the answer is
    /// never [`FrameStep::NeedMore`] without any byte consumed.
    ///
    /// Bytes from the first bad frame to the next good one are one damage. Sequence number 0 begins a new count.
    pub fn step<'a>(&mut self, bytes: &'a [u8], is_last: bool) -> (usize, FrameStep<'a>) {
        let mut position = 0;
        // Each round but the last moves the position ahead.
        for _ in 0..=bytes.len() {
            if self.damage.is_some() {
                position = next_candidate(bytes, position);
            }
            let rest = bytes.get(position..).unwrap_or_default();
            if rest.is_empty() {
                break;
            }
            match parse(rest) {
                Parsed::Frame(frame) => return self.deliver(position, frame),
                Parsed::Incomplete if !is_last => return self.consume(position, FrameStep::NeedMore),
                Parsed::Incomplete => self.begin_damage(position, DamageReason::Cut),
                Parsed::Bad(reason) => self.begin_damage(position, reason),
            }
            position += 1;
        }
        if !is_last {
            return self.consume(bytes.len(), FrameStep::NeedMore);
        }
        self.expected = None;
        match self.damage.take() {
            Some((offset, reason)) => {
                let skipped = self.offset + bytes.len() as u64 - offset;
                self.consume(bytes.len(), FrameStep::Damage(Damage { offset, skipped, reason }))
            }
            None => self.consume(bytes.len(), FrameStep::End),
        }
    }

    fn begin_damage(&mut self, position: usize, reason: DamageReason) {
        if self.damage.is_none() {
            self.damage = Some((self.offset + position as u64, reason));
        }
    }

    fn consume<'a>(&mut self, count: usize, step: FrameStep<'a>) -> (usize, FrameStep<'a>) {
        self.offset += count as u64;
        (count, step)
    }

    /// Hands out the frame at `position`, or first what is to be said about the bytes before it.
    fn deliver<'a>(&mut self, position: usize, frame: Frame<'a>) -> (usize, FrameStep<'a>) {
        let offset = self.offset + position as u64;
        if let Some((start, reason)) = self.damage.take() {
            // Frames that are missing are explained by the damage.
            self.expected = None;
            // A frame that seemed to be cut, with a good one behind it, had a wrong length.
            let reason = if reason == DamageReason::Cut { DamageReason::Length } else { reason };
            let damage = Damage { offset: start, skipped: offset - start, reason };
            return self.consume(position, FrameStep::Damage(damage));
        }
        match self.expected {
            Some(expected) if expected != frame.sequence && frame.sequence != 0 => {
                self.expected = None;
                let reason = DamageReason::Sequence { expected, found: frame.sequence };
                self.consume(position, FrameStep::Damage(Damage { offset, skipped: 0, reason }))
            }
            _ => {
                self.expected = Some(frame.sequence.wrapping_add(1));
                self.consume(position + frame.length(), FrameStep::Frame { offset, frame })
            }
        }
    }
}
