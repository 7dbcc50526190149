//! Bytes and what they mean: literal telegrams, round trips of any value, framing of any pieces, and whole conversations.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, reason = "a panic is how a test fails")]

mod clock;
mod framing;
mod literal;
mod peer;
mod revolution;
mod round_trip;
mod session;
mod values;
mod watch;
