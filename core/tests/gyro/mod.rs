//! A gyro: its turns against closed forms, its states against a filter with all of them, and drives whose truth is known.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is how a test fails")]

mod drive;
mod drives;
mod random;
mod state;
mod turns;
