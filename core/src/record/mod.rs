//! The log: what the localiser was told and what it answered, as framed and checksummed records.
//!
//! A log is a sequence of frames and nothing else, so it can be a file, a stream over a network, or the tail of either:
//!
//! | bytes | content |
//! |---|---|
//! | 4 | magic, `D6 41 47 56` |
//! | 1 | format version |
//! | 1 | kind of record |
//! | 2 | length of the payload, little-endian, at most 32 KiB |
//! | 4 | sequence number, little-endian |
//! | | payload |
//! | 4 | CRC-32 (ISO-HDLC, as in Ethernet and zip) of everything above, little-endian |
//!
//! This layout is the same in every version; a version number stands for the meaning of kinds and payloads. A payload is
//! in the postcard encoding (postcard.jamesmunns.com), except that the beams of a scan follow its postcard head as plain
//! little-endian numbers, because a scan has thousands of them.
//!
//! Readers take a frame for good only if its checksum is right. After damage they go on at the next good frame.

mod frame;
mod log;
mod payload;
mod published;
mod state_piece;
mod truth;

pub use frame::{
    CHECKSUM_LENGTH, Damage, DamageReason, FORMAT_VERSION, Frame, FrameReader, FrameStep, HEADER_LENGTH, MAGIC,
    MAX_FRAME, MAX_PAYLOAD,
};
pub use log::{Item, LogReader, Step, encode};
pub use payload::{EncodeError, Header, LANDMARKS_A_RECORD, Output, RAW_A_RECORD, Raw, RawSource, Record, Scratch};
pub use published::Published;
pub use state_piece::{STATE_A_RECORD, StateOwner, StatePiece};
pub use truth::{Reference, Truth};
