//! A log: records in frames, one after the other.

use super::frame::{Damage, DamageReason, Frame, FrameReader, FrameStep, seal};
use super::payload::{DecodeError, EncodeError, Record, Scratch};

/// Writes `record` as a frame to the beginning of `buffer` and returns its length, bytes. A buffer of
/// [`MAX_FRAME`](super::MAX_FRAME) bytes has room for every record.
///
/// # Errors
/// If the buffer is too short, or the record is longer than a frame can be.
pub fn encode(record: &Record, sequence: u32, buffer: &mut [u8]) -> Result<usize, EncodeError> {
    let payload_length = record.write_payload(buffer)?;
    seal(record.kind(), sequence, payload_length, buffer).ok_or(EncodeError::Buffer)
}

impl<'a> Frame<'a> {
    /// The record in the frame; what cannot be borrowed from the frame's bytes is copied to `scratch`.
    ///
    /// # Errors
    /// If this version knows no such kind, if the payload is not what the kind demands, or if the scratch is too small.
    pub fn record<const BEAMS: usize, const REFLECTORS: usize>(
        &self,
        scratch: &'a mut Scratch<BEAMS, REFLECTORS>,
    ) -> Result<Record<'a>, DamageReason> {
        Record::read_payload(self.kind, self.payload, scratch).map_err(|error| match error {
            DecodeError::Kind => DamageReason::Kind(self.kind),
            DecodeError::Content | DecodeError::Capacity => DamageReason::Payload,
        })
    }
}

/// One thing found in a log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Item<'a> {
    /// A good record.
    Record {
        /// Where its frame begins, bytes from the start of the log.
        offset: u64,
        /// Its sequence number.
        sequence: u32,
        /// The record.
        record: Record<'a>,
    },
    /// A place at which the log is not as it was written. Reading goes on behind it.
    Damage(Damage),
}

/// What [`LogReader::step`] found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step<'a> {
    /// A record or damage.
    Item(Item<'a>),
    /// Nothing yet: call again with more bytes behind those that were not consumed.
    NeedMore,
    /// Nothing any more.
    End,
}

/// Reads a log that arrives in pieces. It holds no bytes itself; records borrow from the caller's bytes and scratch.
#[derive(Clone, Debug, Default)]
pub struct LogReader {
    frames: FrameReader,
}

impl LogReader {
    /// A reader at the start of a log.
    #[must_use]
    pub const fn new() -> Self {
        Self { frames: FrameReader::new() }
    }

    /// How many bytes have been consumed since the start of the log.
    #[must_use]
    pub const fn offset(&self) -> u64 {
        self.frames.offset()
    }

    /// The next record or damage at the beginning of `bytes`, and how many bytes are consumed: as
    /// [`FrameReader::step`], with records instead of frames.
    pub fn step<'a, const BEAMS: usize, const REFLECTORS: usize>(
        &mut self,
        bytes: &'a [u8],
        is_last: bool,
        scratch: &'a mut Scratch<BEAMS, REFLECTORS>,
    ) -> (usize, Step<'a>) {
        let (consumed, step) = self.frames.step(bytes, is_last);
        let step = match step {
            FrameStep::Frame { offset, frame } => Step::Item(match frame.record(scratch) {
                Ok(record) => Item::Record { offset, sequence: frame.sequence, record },
                Err(reason) => Item::Damage(Damage { offset, skipped: frame.length() as u64, reason }),
            }),
            FrameStep::Damage(damage) => Step::Item(Item::Damage(damage)),
            FrameStep::NeedMore => Step::NeedMore,
            FrameStep::End => Step::End,
        };
        (consumed, step)
    }
}
